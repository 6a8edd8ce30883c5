// A port that was opened and that the model in force does not mention: nothing passes there, and
// its name may be misspelt.
#pragma once

#include <string>

namespace arbiter::cli {

enum class Direction { kOutput, kInput };

// Says so on standard error if it is one, with the name that was probably meant. Says nothing where
// the daemon does not let us observe.
void warn_if_unmentioned(const std::string& instance, Direction direction, const std::string& port);

}  // namespace arbiter::cli
