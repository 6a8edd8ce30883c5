// What a component of the round does, in its process or thread.
#pragma once

#include <cstdint>

#include "tests/stress/plan.hpp"
#include "tests/stress/records.hpp"

namespace arbiter::stress {

// Opens its ports, works until the phase says to stop, keeps them open until the round ends. A
// successor waits until it may have the names.
void run_component(const Plan& plan, Records& records, std::uint32_t component,
                   std::uint32_t incarnation);

}  // namespace arbiter::stress
