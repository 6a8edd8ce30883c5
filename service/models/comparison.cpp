#include "service/models/comparison.hpp"

#include <sstream>

#include <nlohmann/json.hpp>

#include "rules/ask/model_diff.hpp"

namespace arbiter::service {

nlohmann::json changes_json(const rules::CompiledModel& before, const rules::CompiledModel& after,
                            std::uint64_t steps, const std::stop_token& stop) {
  rules::Budget budget(steps, stop);
  const rules::ModelDiff diff = rules::diff(before, after, budget);
  std::ostringstream text;
  rules::write_text(text, diff);
  std::ostringstream json;
  rules::write_json(json, diff);
  return {{"summary", rules::summary(diff)},
          {"text", text.str()},
          {"diff", nlohmann::json::parse(json.str())}};
}

}  // namespace arbiter::service
