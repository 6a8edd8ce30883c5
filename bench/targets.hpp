// What the project promises of its speed, as figures of one run.
#pragma once

#include <vector>

#include "bench/harness/report.hpp"

namespace arbiter::bench {

std::vector<Verdict> judge(const Report& report);

}  // namespace arbiter::bench
