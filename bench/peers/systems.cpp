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
  systems.push_back(iceoryx_system());
  systems.push_back(cyclone_system());
  systems.push_back(zeromq_system());
  systems.push_back(message_queue_system());
  systems.push_back(relay_system());
  return systems;
}

}  // namespace arbiter::bench
