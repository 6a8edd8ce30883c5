#include "service/comparison.hpp"

#include <nlohmann/json.hpp>

namespace arbiter::service {

std::string summary_of_changes(const rules::CompiledModel& before,
                               const rules::CompiledModel& after) {
  return std::to_string(before.ports.size()) + " ports before, " +
         std::to_string(after.ports.size()) + " after";
}

nlohmann::json changes_json(const rules::CompiledModel& before, const rules::CompiledModel& after) {
  return {{"summary", summary_of_changes(before, after)},
          {"text", summary_of_changes(before, after)}};
}

}  // namespace arbiter::service
