// Names of ports on the command line.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "rules/text/names.hpp"

namespace arbiter::cli {

// What no port can be called is wrong use, whether a daemon runs or not.
inline CLI::Validator name_of_port() {
  return {[](std::string& name) -> std::string {
            if (name.empty()) return "is empty; write a port's name, such as /Arm/pos:o";
            const auto problem = rules::find_problem_in_port(name);
            return problem ? problem->message : "";
          },
          ""};
}

}  // namespace arbiter::cli
