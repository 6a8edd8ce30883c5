#include "bench/peers/contest.hpp"

#include "bench/peers/systems.hpp"

namespace arbiter::bench {

const std::vector<ContestSystem>& contest_systems() {
  static const std::vector<ContestSystem> systems{
      {kArbiter, Role::kOurs, arbiter_contest},
      {kCyclone, Role::kPeer, cyclone_contest},
      {kRelay, Role::kPeer, relay_contest},
  };
  return systems;
}

}  // namespace arbiter::bench
