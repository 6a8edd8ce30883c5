// The account of an input port's lanes, in which it tells each publisher how far it has read.
#pragma once

#include <algorithm>
#include <iterator>

#include "shm/assertion.hpp"
#include "shm/input_segment.hpp"

namespace arbiter::detail {

// Each queue has a lane of its own, and no other lane is taken. The port alone writes the segment.
template <class Queues>
void require_lanes_balance(const shm::InputSegment& segment, const Queues& queues) noexcept {
  const auto taken = std::count_if(
      std::begin(segment.lanes), std::end(segment.lanes),
      [](const shm::Lane& lane) { return lane.publisher.load(std::memory_order_relaxed) != 0; });
  ARBITER_ASSERT(static_cast<std::size_t>(taken) == queues.size(),
                 "an input port has more lanes or fewer than queues");
  for (const auto& queue : queues) {
    ARBITER_ASSERT(queue.lane->publisher.load(std::memory_order_relaxed) == queue.peer->instance,
                   "a queue has another's lane");
  }
}

}  // namespace arbiter::detail
