// YARP's description of an application, of which the connections concern us, and the modules.
#pragma once

#include "rules/model/model.hpp"
#include "rules/text/diagnostic.hpp"
#include "rules/text/text_file.hpp"

namespace arbiter::rules {

// Everything else is passed over, for these files are written for other readers.
Application read_application(const TextFile& file, Diagnostics& diagnostics);

}  // namespace arbiter::rules
