// Nodes of this process that have ended unheard: a daemon keeps their ports for as long as the
// process lives. Whichever node of the process speaks to that daemon, or its successor, says so.
//
// Thread safety: all.
#pragma once

#include <cstdint>

#include "shm/segment.hpp"

namespace arbiter::detail {

// `board`: of the memory in which the node has that number. The last 64 are remembered.
void remember_ended(const shm::SegmentIdentity& board, std::uint64_t node) noexcept;

// One of that memory, which is forgotten with this; 0: there is none.
[[nodiscard]] std::uint64_t take_ended(const shm::SegmentIdentity& board) noexcept;

}  // namespace arbiter::detail
