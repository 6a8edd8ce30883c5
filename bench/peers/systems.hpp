// All systems, by name.
#pragma once

#include <memory>

#include "bench/harness/rounds.hpp"
#include "bench/peers/system.hpp"

namespace arbiter::bench {

inline const char* const kArbiter = "arbiter, 8 activities";
inline const char* const kCacheLine = "cache line";
inline const char* const kPipe = "pipe";
inline const char* const kIceoryx = "iceoryx";
inline const char* const kCyclone = "Cyclone DDS";
inline const char* const kRelay = "relay with Lua rules";

std::unique_ptr<System> arbiter_system();         // its rule reads eight activities, at both ends
std::unique_ptr<System> arbiter_without_rules();  // a rule that always holds

// Floors.
std::unique_ptr<System> cache_line_system();
std::unique_ptr<System> pipe_system();
std::unique_ptr<System> eventfd_system();
std::unique_ptr<System> futex_system();

std::unique_ptr<System> unix_datagram_system();
std::unique_ptr<System> iceoryx_system();
std::unique_ptr<System> cyclone_system();
std::unique_ptr<System> zeromq_system();
std::unique_ptr<System> message_queue_system();
std::unique_ptr<System> relay_system();  // its rule reads eight activities

Systems all_systems();

// iceoryx's publish() to so many subscribers that take nothing; by batches.
Contender iceoryx_fan_out(int subscribers, int batch);

}  // namespace arbiter::bench
