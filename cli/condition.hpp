// A statement about winners and active sources, as an option's value.
#pragma once

#include <string>

#include "rules/model/statement.hpp"

namespace arbiter::cli {

// What is wrong with it goes to standard error; then it throws CLI::ValidationError, so that it is
// wrong use. `option`: its name, by which places are told.
rules::Statement read_condition(const char* option, const std::string& text);

}  // namespace arbiter::cli
