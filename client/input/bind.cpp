// The port's thread takes up a view, and binds the rules of the model in force.
#include <algorithm>
#include <utility>

#include "client/count.hpp"
#include "client/input/input_core.hpp"
#include "client/input/lanes.hpp"

namespace arbiter::detail {
namespace {

const shm::Atomic<std::uint64_t> nothing_seen{0};

}  // namespace

void InputCore::accept_view() {
  std::unique_ptr<InputView> view = handover_.accept();
  if (view == nullptr) return;
  const auto link_of = [&](const Queue& queue) {
    return std::find_if(view->links.begin(), view->links.end(),
                        [&](const OutputLink& link) { return link.peer == queue.peer; });
  };
  for (Queue& queue : queues_) {
    const auto link = link_of(queue);
    if (link != view->links.end()) {
      queue.gone = link->gone;
    } else {
      retire_queue(queue, *view);
    }
  }
  std::erase_if(queues_, [](const Queue& queue) { return queue.lane == nullptr; });
  count(segment_->header.counters.overtaken,
        view->let_go - std::exchange(counted_let_go_, view->let_go));
  for (const OutputLink& link : view->links) {
    const bool known = std::any_of(queues_.begin(), queues_.end(),
                                   [&](const Queue& queue) { return queue.peer == link.peer; });
    if (known || link.peer->drained.load(std::memory_order_relaxed)) continue;
    Queue queue;
    queue.peer = link.peer;
    queue.gone = link.gone;
    queue.allocated_slots = link.peer->allocated_slots.load(std::memory_order_relaxed);
    queue.reader = shm::ChannelReader(link.peer->segment, link.peer->instance, link.peer->link);
    queue.lane = free_lane();
    if (queue.lane == nullptr) continue;
    queue.lane->source.store(link.peer->source, std::memory_order_relaxed);
    queue.lane->consumed.store(0, std::memory_order_relaxed);
    queue.lane->taken.store(0, std::memory_order_relaxed);
    queue.lane->dropped.store(0, std::memory_order_relaxed);
    queue.lane->overtaken.store(0, std::memory_order_relaxed);
    queue.lane->publisher.store(link.peer->instance, std::memory_order_relaxed);
    // SYNC POINT: lane-given. Release, with the acquire in OutputCore::lane_of().
    queue.lane->link.store(link.peer->link, std::memory_order_release);
    queues_.push_back(std::move(queue));
  }
  require_lanes_balance(*segment_, queues_);
  // Nothing is known of them yet: no word says so.
  watches_.assign(queues_.size(), {&nothing_seen, 1});
  last_taken_ = kNoQueue;
  waiting_.clear();
  waiting_.reserve(queues_.size());
  handover_.retire(std::exchange(view_, std::move(view)));
  memory_->service_bell().ring();  // to dispose of the old one
  bound_epoch_ = UINT64_MAX;
}

shm::Lane* InputCore::free_lane() noexcept {
  for (shm::Lane& lane : segment_->lanes) {
    if (lane.publisher.load(std::memory_order_relaxed) == 0) return &lane;
  }
  return nullptr;
}

// What the queue still has is lost: its connection is gone; or its publisher is, and a later one of
// the same source has pushed all of it out.
void InputCore::retire_queue(Queue& queue, const InputView& next) {
  const bool is_succeeded =
      std::any_of(next.links.begin(), next.links.end(), [&](const OutputLink& link) {
        return link.peer->source == queue.peer->source &&
               link.peer->instance > queue.peer->instance;
      });
  shm::InputCounters& counters = segment_->header.counters;
  join(queue);
  if (is_succeeded) {
    count(counters.overtaken, queue.reader.left_behind());
  } else {
    const std::uint64_t end = queue.reader.last_end();
    const std::uint64_t waiting = queue.reader.backlog(end);
    count(counters.dropped, waiting);
    // What several later queues have had in this channel was never ours.
    if (queue.reader.is_last_end_sure()) {
      count(counters.overtaken, queue.reader.unread(end) - waiting);
    }
  }
  if (queue.peer->held != 0) {
    auto kept = std::make_unique<InputView>();
    kept->links.push_back({queue.peer, true});
    lingering_.push_back(std::move(kept));
  }
  queue.peer->drained.store(true, std::memory_order_relaxed);
  queue.lane->publisher.store(0, std::memory_order_relaxed);
  queue.lane = nullptr;
}

void InputCore::bind_rules() {
  bound_pages_ = memory_->pages().changes();
  snapshot_ = memory_->tables().snapshot();
  bound_epoch_ = snapshot_.epoch;
  const shm::TableView& table = snapshot_.table;
  picture_.bind(table, port_, memory_->pages());
  selects_one_ = table.is_arbitrated(port_);
  std::size_t reads = 0;
  for (Queue& queue : queues_) {
    queue.connection = table.rule(table.find(queue.peer->source, port_));
    reads += shm::BoundRule::reads_of(queue.connection);
  }
  reads_.resize(std::max(reads_.size(), reads));
  shm::Read* next = reads_.data();
  for (Queue& queue : queues_) {
    queue.rule.bind(queue.connection, memory_->pages(), next, false);
    queue.own = memory_->pages().find(queue.peer->source);
    next += shm::BoundRule::reads_of(queue.connection);
  }
}

void InputCore::refresh() {
  if (handover_.has_offer()) accept_view();
  if (memory_->tables().epoch() != bound_epoch_ || memory_->pages().changes() != bound_pages_) {
    bind_rules();
  }
}

}  // namespace arbiter::detail
