// The tool in a time zone: what it says of times of day must not depend on the machine's.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tests/support/run_program.hpp"

namespace arbiter::test {

inline ProgramResult arbiter_in(const std::string& zone, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"/usr/bin/env", "TZ=" + zone, ARBITER_PROGRAMS "/arbiter"});
  return run_program(arguments);
}
inline ProgramResult arbiter_in_utc(std::vector<std::string> arguments) {
  return arbiter_in("UTC", std::move(arguments));
}

}  // namespace arbiter::test
