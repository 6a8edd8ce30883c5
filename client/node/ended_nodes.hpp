// Nodes of this process that have ended, perhaps unheard: a daemon that has not heard it keeps
// their ports for as long as the process lives. Other nodes of the process say so to the daemon,
// and to its successors, until a daemon has read it.
//
// Thread safety: all. A child begins with none.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <vector>

#include "client/service_bell.hpp"
#include "shm/segment.hpp"

namespace arbiter::detail {

// `board`: of the memory in which the node has that number. Of all memory the last 65536 are
// remembered. Rings for another node of that memory, which is to say it; `own` is the bell of the
// one that ends.
void remember_ended(const shm::SegmentIdentity& board, std::uint64_t node,
                    const ServiceBell* own) noexcept;

// Whether any is remembered. It may be late by a moment, but not for whoever is rung: a bell is
// rung by a system call behind the mutex.
[[nodiscard]] bool has_any_ended() noexcept;
// Those of that memory. Throws std::bad_alloc.
[[nodiscard]] std::vector<std::uint64_t> ended_in(const shm::SegmentIdentity& board);
// Of these, those that the node with that bell is to say, unasked: it was rung for them, or whoever
// was has ended. Throws std::bad_alloc.
[[nodiscard]] std::vector<std::uint64_t> ended_to_tell(
    const shm::SegmentIdentity& board, const std::shared_ptr<const ServiceBell>& bell);
// They have been heard.
void forget_ended(const shm::SegmentIdentity& board, const std::set<std::uint64_t>& nodes) noexcept;

// Of a node with that memory, which may be rung from now on. `has_thread`: it hears by itself.
// Throws std::bad_alloc.
void ring_for_ended(const std::shared_ptr<const ServiceBell>& bell,
                    const shm::SegmentIdentity& board, bool has_thread);

}  // namespace arbiter::detail
