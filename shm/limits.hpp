// Every bound of the shared memory, in one place. What runs into one is told its name.
#pragma once

#include <cstddef>
#include <cstdint>

namespace arbiter::shm {

// g++ warns that std::hardware_destructive_interference_size may change with flags; a layout that
// several programs share must not.
inline constexpr std::size_t kCacheLine = 64;
inline constexpr std::size_t kPageSize = 4096;

inline constexpr std::uint32_t kMaxSourcesPerPort = 256;  // connected and sensed together
inline constexpr std::uint32_t kMaxConnections = 4096;    // of one model
inline constexpr std::uint32_t kMaxDestinations = 64;     // of one output port
inline constexpr std::uint32_t kMaxSources = 8192;        // names of output ports, one instance
inline constexpr std::uint32_t kMaxInputPorts = 4096;     // names of input ports, one instance
inline constexpr std::uint32_t kMaxNodesPerConnection = 65536;  // of one decision diagram
inline constexpr std::uint32_t kMaxTableWords = 4u << 20;       // one flat decision table, 16 MiB
inline constexpr std::uint32_t kMaxNameLength = 255;            // bytes of a port's or node's name
inline constexpr std::uint32_t kMaxDepth = 1024;                // samples queued on one connection
inline constexpr std::uint32_t kMaxHeld = 64;                   // samples a component holds at once
inline constexpr std::uint32_t kMaxLoans = 64;                  // samples being written at once
inline constexpr std::uint32_t kMaxSlots = 65535;               // payload slots of one output port
inline constexpr std::uint32_t kMaxTaps = 16;                   // of one output port
inline constexpr std::uint32_t kMaxTapHeld = 16;                // samples that a tap holds at once
inline constexpr std::uint32_t kMaxKept = 64;                   // samples kept for a port's taps
inline constexpr std::uint32_t kMaxEvents = 1024;         // told to a port's taps, the last ones
inline constexpr std::uint32_t kMaxDestinationLists = 8;  // likewise
inline constexpr std::uint32_t kMaxClients = 4096;        // of one daemon
inline constexpr std::uint32_t kMaxPostponed = 64;        // requests of one client
inline constexpr std::uint32_t kMaxSilentClients = 256;   // that have not said who they are

}  // namespace arbiter::shm
