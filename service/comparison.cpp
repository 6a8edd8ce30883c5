#include "service/comparison.hpp"

#include <sstream>

#include <nlohmann/json.hpp>

#include "rules/model_diff.hpp"

namespace arbiter::service {
namespace {

// A few tenths of a second, for which a change of the model waits.
constexpr std::uint64_t kSteps = 3'000'000;
// What has been asked for may take longer.
constexpr std::uint64_t kStepsOfDryRun = 30'000'000;

}  // namespace

std::string summary_of_changes(const rules::CompiledModel& before,
                               const rules::CompiledModel& after, const std::stop_token& stop) {
  rules::Budget budget(kSteps, stop);
  return rules::summary(rules::diff(before, after, budget));
}

nlohmann::json changes_json(const rules::CompiledModel& before, const rules::CompiledModel& after,
                            const std::stop_token& stop) {
  rules::Budget budget(kStepsOfDryRun, stop);
  const rules::ModelDiff diff = rules::diff(before, after, budget);
  std::ostringstream text;
  rules::write_text(text, diff);
  std::ostringstream json;
  rules::write_json(json, diff);
  return {{"text", text.str()}, {"diff", nlohmann::json::parse(json.str())}};
}

}  // namespace arbiter::service
