// Patterns of a policy that match no port of any model: most are misspelt, and then guard nothing.
#pragma once

#include <string_view>
#include <vector>

#include "rules/text/diagnostic.hpp"
#include "service/policy/policy.hpp"

namespace arbiter::service {

// The ports that models name.
struct NamedPorts {
  std::vector<std::string_view> outputs;  // of sources
  std::vector<std::string_view> inputs;
};

// Warns of each, but of none that an action is about ports of which there are none at all.
void find_unmatched(const Policy& policy, NamedPorts ports, rules::Diagnostics& diagnostics);

}  // namespace arbiter::service
