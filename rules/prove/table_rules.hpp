// Rules as a decision table has them, for where the model that it was made of is not known.
#pragma once

#include <functional>
#include <string>

#include "rules/model/rule_set.hpp"
#include "shm/decision_table.hpp"

namespace arbiter::rules {

// Of one port; without behaviours, places and provenance.
RuleSet rules_of_table(const shm::TableView& table, shm::PortId port, const std::string& port_name,
                       const std::function<std::string(shm::SourceId)>& source_name);

}  // namespace arbiter::rules
