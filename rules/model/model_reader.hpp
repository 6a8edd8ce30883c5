// Reads one file of behaviours into the model that it is a part of.
#pragma once

#include "rules/model/model.hpp"
#include "rules/text/defines.hpp"
#include "rules/text/diagnostic.hpp"
#include "rules/text/text_file.hpp"

namespace arbiter::rules {

// Appends to `model`; `defines` are those of the files before, and then also of this one. True
// where the file is an application that has its model inside, in <arbitration>.
bool read_model(const TextFile& file, Defines& defines, Model& model, Diagnostics& diagnostics);

}  // namespace arbiter::rules
