// Names of ports on the command line.
#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>

#include "command_line/shell_word.hpp"
#include "rules/ask/source_as_port.hpp"
#include "rules/text/names.hpp"

namespace arbiter::cli {

// What no port can be called is wrong use, whether a daemon runs or not.
inline CLI::Validator name_of_port(bool or_pattern = false) {
  return {[or_pattern](std::string& name) -> std::string {
            if (name.empty()) return "is empty; write a port's name, such as /Arm/pos:o";
            if (or_pattern && name.find('*') != std::string::npos) return "";
            const auto problem = rules::find_problem_in_port(name);
            return problem ? problem->message : "";
          },
          ""};
}

// Throws std::runtime_error where the model has no such input port. `option`: what the port stands
// behind, such as "--port ".
inline void require_port(const rules::RuleSet& rules, const std::string& port,
                         const std::string& option) {
  const auto is_it = [&](const auto& each) { return each.port == port; };
  if (std::any_of(rules.ports.begin(), rules.ports.end(), is_it) ||
      std::any_of(rules.other_connections.begin(), rules.other_connections.end(), is_it)) {
    return;
  }
  const auto instead = [&](const std::string& meant, const std::string& /*source*/) {
    return option + command_line::shell_word(meant);
  };
  throw std::runtime_error(
      rules::about_no_port({port, "the model has no input port " + port, instead}, rules));
}

}  // namespace arbiter::cli
