// Who has the ports of a model, beside an application that says which modules there are: one module
// or one entry of a mapping has each.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "gateway/mapping/mapping.hpp"
#include "rules/model/model.hpp"
#include "rules/model/rule_set.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::gateway {

// Of mappings that were read without an error. An application without modules says nothing of it,
// nor does one that could not be read as a whole. A module that is called as a gateway's program is
// that gateway.
void check_owners(const std::vector<Mapping>& mappings, const rules::RuleSet& model,
                  const rules::Application& application, rules::Diagnostics& diagnostics);

// The ports that the entries feed (`is_in`), or those that they take from.
[[nodiscard]] std::set<std::string> ports_of(const std::vector<Mapping>& mappings, bool is_in);

// Where no application says which modules there are: a note of each input port of the model that no
// entry takes from, since only a component can.
void check_takers(const std::vector<Mapping>& mappings, const rules::RuleSet& model,
                  rules::Diagnostics& diagnostics);

}  // namespace arbiter::gateway
