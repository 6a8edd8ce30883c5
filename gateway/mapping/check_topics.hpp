// What of a mapping's topics contradicts itself, beside other mappings: those that go in a circle,
// that two ports command, or whose domain has two configurations.
#pragma once

#include <vector>

#include "gateway/mapping/mapping.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::gateway {

// As check_mappings().
void check_topics(const std::vector<Mapping>& mappings, rules::Diagnostics& diagnostics);

}  // namespace arbiter::gateway
