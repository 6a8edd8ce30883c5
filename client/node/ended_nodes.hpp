// Nodes of this process that have ended, perhaps unheard: a daemon that has not heard it keeps
// their ports for as long as the process lives. Each node of the process says so to the daemon, and
// to its successors, until a daemon has read it.
//
// Thread safety: all.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <vector>

#include "client/service_bell.hpp"
#include "shm/segment.hpp"

namespace arbiter::detail {

// `board`: of the memory in which the node has that number. Of all memory the last 65536 are
// remembered. Rings for the other nodes.
void remember_ended(const shm::SegmentIdentity& board, std::uint64_t node) noexcept;

// Whether any is remembered. Relaxed is enough: who rings has remembered it before.
[[nodiscard]] bool has_any_ended() noexcept;
// Those of that memory. Throws std::bad_alloc.
[[nodiscard]] std::vector<std::uint64_t> ended_in(const shm::SegmentIdentity& board);
// They have been heard.
void forget_ended(const shm::SegmentIdentity& board, const std::set<std::uint64_t>& nodes) noexcept;

// Of a node, which hears by it of those that end. Throws std::bad_alloc.
void ring_for_ended(const std::shared_ptr<const ServiceBell>& bell);

}  // namespace arbiter::detail
