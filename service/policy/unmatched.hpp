// Patterns of a policy that fit no port of any model: many are misspelt.
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

// Notes each: components may open ports that no model names. Of those on a kind of port of which
// there is none at all, nothing is said. Takes a second at most, and then leaves the rest out.
void find_unmatched(const Policy& policy, NamedPorts ports, rules::Diagnostics& diagnostics);

}  // namespace arbiter::service
