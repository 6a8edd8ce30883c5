// A connection's queue goes on through the deaths of its publishers: what each has left waits in
// its own segment, which its receiver keeps mapped. Together they are one queue, at most `depth`
// long.
//
// So a sample has been pushed out once `depth` later ones have been accepted, whether or not the
// component takes; and a publisher that is gone, all of whose samples have been pushed out, or that
// has left none, is let go of. That is known without asking the port's thread, which takes the
// oldest first: what it has taken already is no reason to keep the older ones.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "client/peers.hpp"

namespace arbiter::detail {

// The most publishers that are gone and are kept for their samples: what a port has lanes for
// beside those that live. Where there are more the oldest are let go of, too.
inline constexpr std::size_t kMaxPredecessors = shm::kMaxLanes - shm::kMaxSourcesPerPort;

// How many samples its publisher has put into a link's queue, in all.
std::uint64_t accepted_on(const OutputPeer& peer) noexcept;

// Those that a port of this depth may let go of.
std::vector<shm::PortInstance> spent_predecessors(
    const std::map<shm::PortInstance, OutputLink>& links, std::uint32_t depth);

}  // namespace arbiter::detail
