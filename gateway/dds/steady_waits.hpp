// Cyclone's threads wait by the clock of the day: if somebody sets that back by an hour, as a robot
// without a battery for its clock does once it has a network, they sleep for an hour longer.
// Meanwhile nothing lost is repeated, nothing is said to whoever may be there, and other hosts take
// this one for gone. So they wait by the clock that nobody sets.
#pragma once

namespace arbiter::gateway::dds {

// From the start of the process on, in each program that calls it.
void wait_by_steady_clock() noexcept;

}  // namespace arbiter::gateway::dds
