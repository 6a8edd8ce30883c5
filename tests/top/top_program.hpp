// arbiter top, as it is run by hand.
#pragma once

#include <string>
#include <vector>

#include "tests/support/emulated_terminal.hpp"

namespace arbiter::test {

// Activity ends only by deactivate(), so that no test depends on time.
inline const std::string kTopModel = R"(<behaviors timeout="forever">
  <behavior name="Low"><config at="/p:i">/low:o</config></behavior>
  <behavior name="High"><config at="/p:i">/high:o</config><inhibition>Low</inhibition></behavior>
</behaviors>)";

inline const std::string kArbiter = std::string(ARBITER_PROGRAMS) + "/arbiter";

inline Environment top_environment(const Environment& changes = {}) {
  Environment result{{"TERM", "xterm-256color"},
                     {"LC_ALL", "C.UTF-8"},
                     {"NO_COLOR", std::nullopt},
                     {"LINES", std::nullopt},
                     {"COLUMNS", std::nullopt}};
  for (const auto& [name, value] : changes) result[name] = value;
  return result;
}

}  // namespace arbiter::test
