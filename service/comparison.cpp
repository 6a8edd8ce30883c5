#include "service/comparison.hpp"

#include <sstream>

#include <nlohmann/json.hpp>

#include "rules/model_diff.hpp"

namespace arbiter::service {
namespace {

// Nodes of decision diagrams: some hundredths of a second, in which the daemon serves nobody.
constexpr std::uint64_t kMaxWork = 500'000;

}  // namespace

nlohmann::json changes_json(const rules::CompiledModel& before, const rules::CompiledModel& after) {
  const rules::ModelDiff diff = rules::diff(before, after, kMaxWork);
  std::ostringstream text;
  rules::write_text(text, diff);
  std::ostringstream json;
  rules::write_json(json, diff);
  return {{"summary", rules::summary(diff)},
          {"text", text.str()},
          {"diff", nlohmann::json::parse(json.str())}};
}

}  // namespace arbiter::service
