#include "bench/peers/systems.hpp"

namespace arbiter::bench {

Systems all_systems() {
  Systems systems;
  systems.push_back(arbiter_system());
  systems.push_back(arbiter_without_rules());
  systems.push_back(cache_line_system());
  systems.push_back(pipe_system());
  systems.push_back(eventfd_system());
  systems.push_back(futex_system());
  systems.push_back(unix_datagram_system());
  return systems;
}

}  // namespace arbiter::bench
