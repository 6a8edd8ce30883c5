// All systems, by name.
#pragma once

#include <memory>

#include "bench/peers/system.hpp"

namespace arbiter::bench {

inline const char* const kArbiter = "arbiter, 8 activities";
inline const char* const kCacheLine = "cache line";
inline const char* const kPipe = "pipe";

std::unique_ptr<System> arbiter_system();         // its rule reads eight activities, at both ends
std::unique_ptr<System> arbiter_without_rules();  // a rule that always holds

// Floors.
std::unique_ptr<System> cache_line_system();
std::unique_ptr<System> pipe_system();
std::unique_ptr<System> eventfd_system();
std::unique_ptr<System> futex_system();

std::unique_ptr<System> unix_datagram_system();

Systems all_systems();

}  // namespace arbiter::bench
