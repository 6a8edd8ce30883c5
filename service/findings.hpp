// What readers find in files, for the log and for whoever asked to have them read.
#pragma once

#include <string>

#include "rules/diagnostic.hpp"

namespace arbiter::service {

void log_findings(const rules::Diagnostics& diagnostics);

// file:line:column: message, of the first error, and how many more there are.
std::string first_error(const rules::Diagnostics& diagnostics);

}  // namespace arbiter::service
