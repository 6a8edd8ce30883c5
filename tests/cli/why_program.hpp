// arbiter why, as it is run by hand, and its answers.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/cli/arbiter_program.hpp"

namespace arbiter::test {

// Activity ends only by deactivate(), so that no test depends on time.
inline const std::string kGazeModel = R"(<behaviors timeout="forever">
<meta_behavior name="Curious"><behavior>Look</behavior><behavior>Follow</behavior></meta_behavior>
<behavior name="Look"><config at="/gaze">/random</config></behavior>
<behavior name="Follow"><config at="/gaze">/face</config><inhibition>Look</inhibition></behavior>
<behavior name="Track"><config at="/gaze">/object</config>
  <condition>not /collision</condition>
  <inhibition>Curious</inhibition></behavior>
</behaviors>)";

inline nlohmann::json why_json(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "why");
  arguments.emplace_back("--json");
  const auto result = arbiter(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return result.exit_code == 0 ? nlohmann::json::parse(result.out) : nlohmann::json();
}

inline nlohmann::json connection(const nlohmann::json& answer, const std::string& source) {
  for (const auto& each : answer.at("connections")) {
    if (each.at("source") == source) return each;
  }
  return nullptr;
}

// Of obstacles: what they say, or which they are.
inline std::vector<std::string> texts(const nlohmann::json& list, const char* key = "text") {
  std::vector<std::string> result;
  for (const auto& each : list) result.push_back(each.at(key));
  return result;
}
inline std::vector<std::string> codes(const nlohmann::json& list) { return texts(list, "code"); }

inline std::string why(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "why");
  const auto result = arbiter(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return result.out;
}

}  // namespace arbiter::test
