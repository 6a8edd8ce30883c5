// How sources, ports and live ports are named in shared memory.
#pragma once

#include <cstdint>

namespace arbiter::shm {

// Given by the daemon; stable for as long as it runs, across models.
using SourceId = std::uint32_t;
using PortId = std::uint32_t;
using ConnectionIndex = std::uint32_t;  // of one decision table

inline constexpr std::uint32_t kNone = 0xffffffff;

// A live port, for as long as it is open: never 0, never given twice by one daemon, below 2^48.
using PortInstance = std::uint64_t;

}  // namespace arbiter::shm
