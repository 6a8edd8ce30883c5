// The arbiter program, as it is run by hand.
#pragma once

#include <string>
#include <vector>

#include "tests/support/run_program.hpp"

namespace arbiter::test {

inline ProgramResult arbiter(std::vector<std::string> arguments, const char* out_path = nullptr) {
  arguments.insert(arguments.begin(), std::string(ARBITER_PROGRAMS) + "/arbiter");
  return run_program(arguments, {}, out_path);
}

inline const std::string kOverrideModel = R"(<behaviors>
  <behavior name="Low"><config at="/p">/low</config></behavior>
  <behavior name="High"><config at="/p">/high</config><inhibition>Low</inhibition></behavior>
</behaviors>
)";

inline const std::string kConflictModel = R"(<behaviors>
  <behavior name="A"><config at="/p">/a</config></behavior>
  <behavior name="B"><config at="/p">/b</config><condition>not /c</condition></behavior>
</behaviors>
)";

// The paper's arm: with object and collision both active nobody wins, on purpose.
inline const std::string kTrackModel = R"(<behaviors>
  <behavior name="Rest"><config at="/arm">/rest</config></behavior>
  <behavior name="Track"><config at="/arm">/object</config>
    <condition>not /collision</condition><inhibition>Rest</inhibition></behavior>
</behaviors>
)";

}  // namespace arbiter::test
