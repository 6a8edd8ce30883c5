// take(): which sample, if any, the component gets.
//
// The oldest waiting sample whose connection is the winner now. Three steps:
//   look    at the head of each queue, and at where each ends
//   decide  for the oldest head; if it loses and other queues have samples too, for all of them in
//           one picture, so that the whole take has one instant
//   hold    the sample, and see that it is still there
// A decision drops only what was there before it: a sample accepted later was accepted by a later
// one.
//
// take_once() asserts nothing: client/output/publish.cpp says why.
#include <algorithm>

#include "client/count.hpp"
#include "client/input/input_core.hpp"
#include "shm/assertion.hpp"
#include "shm/clock.hpp"

namespace arbiter::detail {
namespace {

// How often a take starts again because publishers overtook it, or changed the picture, meanwhile.
constexpr int kMaxTries = 64;

// How often a take looks for the oldest entry of a queue whose publisher overtakes it.
constexpr int kMaxPeeks = 64;

}  // namespace

HeldSample InputCore::take() {
  if (!epoll_ && nothing_is_new()) return {};
  HeldSample sample = take_once();
  if (sample.data == nullptr && epoll_) arm_descriptor(sample);
  return sample;
}

HeldSample InputCore::take_once() {
  HeldSample sample;
  for (int tries = 0; tries < kMaxTries; ++tries) {
    refresh();
    Queue* oldest = look();
    if (oldest == nullptr) return sample;
    // A publisher that joined since may have delivered before this head was published: look again,
    // with its queue. SYNC POINT: entry-stored. Relaxed is enough in has_offer(): who publishes
    // after the one that joined passes the offer on with the head, which peek() has acquired. A
    // view that is offered later than its publisher delivered, drop_missed() is for.
    if (handover_.has_offer()) continue;
    if (held_ == max_held_) {
      throw Error(name_ + ": " + std::to_string(max_held_) +
                  (max_held_ == 1 ? " sample is" : " samples are") +
                  " held already; give one back first, or raise max_held");
    }
    const Choice choice = keep_ ? Choice::kTake : choose(oldest);
    if (choice == Choice::kNothing) return sample;
    if (choice == Choice::kTake && hold(*oldest, sample)) {
      commanded_ = true;
      last_stamp_ = sample.stamp_ns;
      if (is_measured_.load(std::memory_order_relaxed)) measure(sample.stamp_ns);
      return sample;
    }
  }
  count(segment_->header.counters.unsettled);
  return sample;
}

// Kept out of the take: it is for ports that are tapped.
[[gnu::noinline, gnu::cold]] void InputCore::measure(shm::Nanoseconds stamp) const noexcept {
  count(segment_->header.latencies[shm::latency_bucket(shm::monotonic_now() - stamp)]);
}

// Since the last take has found nothing.
bool InputCore::nothing_is_new() const noexcept {
  if (handover_.has_offer()) return false;
  bool unchanged = true;
  for (const auto& watch : watches_) unchanged = watch.is_unchanged() && unchanged;
  return unchanged;
}

// The queue with the oldest head, or null if nothing waits.
InputCore::Queue* InputCore::look() noexcept {
  Queue* oldest = nullptr;
  bool again = true;
  for (int tries = 0; again && tries < kMaxTries; ++tries) oldest = scan(again);
  return oldest;
}

// One look at each queue. `again`: it may have the wrong order, because a sample came to a queue
// that was found empty before a later one was found behind it, or a head was overtaken as it was
// looked at.
InputCore::Queue* InputCore::scan(bool& again) noexcept {
  again = false;
  for (Queue* const queue : waiting_) queue->head = 0;
  waiting_.clear();
  Queue* oldest = nullptr;
  std::size_t found = 0;  // the queues before this one come before the last find
  for (std::size_t i = 0; i < watches_.size(); ++i) {
    if (watches_[i].is_unchanged() || !look_at(i)) continue;
    Queue& queue = queues_[i];
    waiting_.push_back(&queue);
    found = i;
    if (oldest == nullptr) {
      oldest = &queue;
      continue;
    }
    // Only now does the order matter.
    if (oldest->head_stamp == 0 && !oldest->reader.peek_stamp(oldest->head, oldest->head_stamp)) {
      again = true;
    }
    if (!queue.reader.peek_stamp(queue.head, queue.head_stamp)) again = true;
    if (queue.head_stamp < oldest->head_stamp) oldest = &queue;
  }
  for (std::size_t i = 0; i < found && !again; ++i) {
    if (queues_[i].head != 0 || watches_[i].is_unchanged() || !look_at(i)) continue;
    queues_[i].head = 0;  // for the next scan to find
    again = true;
  }
  return oldest;
}

void InputCore::join(Queue& queue) noexcept {
  if (queue.reader.state() == shm::ChannelReader::State::kUnjoined) look_for_queue(queue);
}

[[gnu::noinline, gnu::cold]] void InputCore::look_for_queue(Queue& queue) noexcept {
  if (!queue.reader.join()) return;
  queue.lane->consumed.store(queue.reader.consumed(), std::memory_order_relaxed);
  if (!keep_) drop_missed(queue);
}

// Our process may have been late to take up the publisher: what waited in its queue when a later
// sample was taken lost then. At a port that is not arbitrated, or keeps, nothing is there yet.
void InputCore::drop_missed(Queue& queue) noexcept {
  auto left = queue.reader.backlog(queue.reader.backlog_end());
  if (left == 0 || last_stamp_ > shm::monotonic_now()) return;  // then that publisher has lied
  for (; left != 0; --left) {
    std::uint64_t lost = 0;
    const shm::Entry entry = queue.reader.peek(lost);
    count_overtaken(queue, lost);
    shm::Nanoseconds stamp = 0;
    if (entry == 0) return;
    if (!queue.reader.peek_stamp(entry, stamp)) continue;  // overtaken just now
    if (stamp >= last_stamp_) return;
    consume(queue);
    count(queue.lane->dropped);
    count(segment_->header.counters.dropped);
  }
}

bool InputCore::look_at(std::size_t index) noexcept {
  Queue& queue = queues_[index];
  if (look_closely(queue)) return true;
  // Of a publisher that is gone, what there is to do depends on its successor too.
  if (!queue.gone) watches_[index] = queue.reader.watch();
  return false;
}

bool InputCore::look_closely(Queue& queue) noexcept {
  using State = shm::ChannelReader::State;
  queue.head = 0;
  queue.head_stamp = 0;
  join(queue);
  if (queue.gone) yield_to_successor(queue);
  // A reader that was overtaken goes forward by steps; each call takes a bounded number of them.
  std::uint64_t lost = 0;
  for (int tries = 0; tries < kMaxPeeks; ++tries) {
    const std::uint64_t before = lost;
    queue.head = queue.reader.peek(lost);
    if (queue.head != 0 || lost == before) break;
  }
  count_overtaken(queue, lost);
  if (queue.reader.state() == State::kMisbehaved &&
      queue.lane->source.load(std::memory_order_relaxed) != shm::kNone) {
    count(segment_->header.counters.misbehaved);
    queue.lane->source.store(shm::kNone, std::memory_order_relaxed);
    queue.peer->misbehaved.store(true, std::memory_order_relaxed);
    memory_->service_bell().ring();
  }
  if (queue.head == 0 && queue.gone && !queue.peer->drained.load(std::memory_order_relaxed)) {
    queue.peer->drained.store(true, std::memory_order_relaxed);
    queue.lane->source.store(shm::kNone, std::memory_order_relaxed);  // for status: nothing waits
    memory_->service_bell().ring();
  }
  return queue.head != 0;
}

// A connection's queue is one, though its publisher was replaced: the old one's samples and the new
// one's together are at most `depth`; the oldest give way.
void InputCore::yield_to_successor(Queue& queue) noexcept {
  std::uint64_t behind = 0;
  for (Queue& other : queues_) {
    if (&other == &queue || other.peer->source != queue.peer->source) continue;
    if (other.peer->instance < queue.peer->instance) continue;
    join(other);
    behind += other.reader.backlog(other.reader.backlog_end());
  }
  const std::uint64_t depth = segment_->header.depth;
  const std::uint64_t room = depth - std::min(behind, depth);
  // Those that its own later ones have overtaken are among them.
  const std::uint64_t own = queue.reader.left_behind();
  if (own <= room) return;
  queue.reader.skip(own - room);
  count_overtaken(queue, own - room);
}

InputCore::Choice InputCore::choose(Queue*& oldest) noexcept {
  Choice choice = decide_alone(*oldest);
  if (choice != Choice::kLoses) return choice;
  // What a decision drops was there before it. So it is taken again, now that the ends are known: a
  // winner's take need not know them, and saves itself the publisher's cache line.
  for (Queue* const queue : waiting_) queue->end = queue->reader.backlog_end();
  if (waiting_.size() > 1) return choose_among_all(oldest);
  choice = decide_alone(*oldest);
  if (choice != Choice::kLoses) return choice;
  drop_losers(nullptr);
  return Choice::kNothing;
}

InputCore::Choice InputCore::decide_alone(Queue& queue) noexcept {
  shm::DecisionClock clock(last_reading_, false);
  queue.verdict = queue.rule.decide(snapshot_.table, clock);
  last_reading_ = clock.reading();
  if (!memory_->tables().is_in_force(snapshot_)) return Choice::kAgain;
  switch (queue.verdict) {
    case shm::Verdict::kWins:
      return Choice::kTake;
    case shm::Verdict::kLoses:
      return Choice::kLoses;
    case shm::Verdict::kBlind:
      return be_blind();
    case shm::Verdict::kUnsettled:
      count(segment_->header.counters.unsettled);
      return Choice::kNothing;
  }
  return Choice::kNothing;
}

InputCore::Choice InputCore::be_blind() noexcept {
  count(segment_->header.counters.blind);
  if (blindness_.begins()) memory_->service_bell().ring();
  return Choice::kNothing;
}

// The oldest head loses: what of the others? Decides for every queue, in one picture.
InputCore::Choice InputCore::choose_among_all(Queue*& chosen) noexcept {
  if (!decide_all()) return Choice::kAgain;
  chosen = nullptr;
  for (Queue* const queue : waiting_) {
    if (queue->verdict == shm::Verdict::kBlind) return be_blind();
    if (queue->verdict != shm::Verdict::kWins) continue;
    if (chosen == nullptr || queue->head_stamp < chosen->head_stamp) chosen = queue;
  }
  drop_losers(chosen);
  return chosen == nullptr ? Choice::kNothing : Choice::kTake;
}

bool InputCore::decide_all() noexcept {
  shm::DecisionClock clock(last_reading_, false);
  const bool is_settled = picture_.take(clock, 1);
  last_reading_ = clock.reading();
  for (Queue* const queue : waiting_) queue->verdict = picture_.decide(queue->connection);
  return is_settled && memory_->tables().is_in_force(snapshot_);
}

// Drops what waited in losing queues before the decision and is older than the sample that is
// taken.
void InputCore::drop_losers(const Queue* winner) noexcept {
  for (Queue* const waiting : waiting_) {
    Queue& queue = *waiting;
    if (queue.verdict != shm::Verdict::kLoses) continue;
    const auto waits = [&] { return queue.reader.backlog(queue.end) != 0; };
    // Each step passes one of them at least: dropped here, or overtaken.
    for (auto left = queue.reader.backlog(queue.end); left != 0 && waits(); --left) {
      std::uint64_t lost = 0;
      const shm::Entry entry = queue.reader.peek(lost);
      count_overtaken(queue, lost);
      if (entry == 0 || !waits()) break;  // what it has now came later than the decision
      shm::Nanoseconds stamp = 0;
      if (winner != nullptr) {
        if (!queue.reader.peek_stamp(entry, stamp)) continue;  // overtaken just now
        if (stamp > winner->head_stamp) break;
      }
      consume(queue);
      count(queue.lane->dropped);
      count(segment_->header.counters.dropped);
    }
  }
}

void InputCore::count_overtaken(Queue& queue, std::uint64_t lost) noexcept {
  if (lost == 0) return;
  count(queue.lane->overtaken, lost);
  count(segment_->header.counters.overtaken, lost);
  queue.reader.tell(queue.lane->consumed);
}

void InputCore::consume(Queue& queue) noexcept {
  queue.reader.consume();
  queue.reader.tell(queue.lane->consumed);
}

std::uint32_t InputCore::free_hold() const {
  for (std::uint32_t i = 0; i < max_held_; ++i) {
    if (segment_->header.holds[i].load(std::memory_order_relaxed) == 0) return i;
  }
  return shm::kNone;  // held_ < max_held_ says that this is never reached
}

bool InputCore::hold(Queue& queue, HeldSample& sample) noexcept {
  const std::uint32_t index = free_hold();
  if (index == shm::kNone) return false;
  shm::Atomic<shm::Hold>& word = segment_->header.holds[index];
  if (!queue.reader.hold(queue.head, word)) return false;
  const std::uint32_t slot = shm::slot_of(queue.head);
  sample.hold = index;
  if (slot < queue.allocated_slots || is_allocated(queue, slot)) {
    const shm::OutputSegment& from = queue.reader.segment();
    const shm::SlotHeader& header = from.slot_header(slot);
    sample.data = from.payload(slot);
    // Of such a type all samples have one size, whatever the publisher says.
    sample.size = one_size_ != 0
                      ? one_size_
                      : std::min<std::uint64_t>(header.size.load(std::memory_order_relaxed),
                                                from.layout().stride);
    sample.sequence = header.sequence.load(std::memory_order_relaxed);
    sample.stamp_ns = header.stamp.load(std::memory_order_relaxed);
  } else if (!copy(queue, slot, sample)) {
    shm::ChannelReader::release(word);
    return false;
  }
  sample.source = queue.peer->source;
  consume(queue);
  count(queue.lane->taken);
  count(segment_->header.counters.taken);
  last_taken_ = static_cast<std::size_t>(&queue - queues_.data());
  held_from_[index] = queue.peer.get();
  ++queue.peer->held;
  ++held_;
  return true;
}

bool InputCore::is_allocated(Queue& queue, std::uint32_t slot) const noexcept {
  queue.allocated_slots = queue.peer->allocated_slots.load(std::memory_order_relaxed);
  return slot < queue.allocated_slots;
}

// A slot that is not known to be allocated: copies.hpp. The service thread is asked to look again,
// for the publisher may have grown later than we were told to look.
bool InputCore::copy(const Queue& queue, std::uint32_t slot, HeldSample& sample) noexcept {
  queue.peer->copied.store(queue.peer->copied.load(std::memory_order_relaxed) + 1,
                           std::memory_order_relaxed);
  memory_->service_bell().ring();
  for (std::uint32_t i = 0; i < max_held_; ++i) {
    if (held_from_[i] == nullptr) copies_.forget(i);
  }
  CopiedSample copied;
  if (!copies_.copy(*queue.peer, slot, one_size_ != 0, sample.hold, copied)) return false;
  sample.data = copied.data;
  sample.size = one_size_ != 0 ? one_size_ : copied.size;
  sample.sequence = copied.sequence;
  sample.stamp_ns = copied.stamp;
  return true;
}

void InputCore::give_back(std::uint32_t hold) noexcept {
  shm::ChannelReader::release(segment_->header.holds[hold]);
  const OutputPeer* const from = std::exchange(held_from_[hold], nullptr);
  ARBITER_ASSERT(from != nullptr, "a sample is given back twice");
  --from->held;
  --held_;
  if (!lingering_.empty()) let_go_of(from);
}

// Its data tell where it lies, also to a child, which has no holds.
shm::SampleOrigin InputCore::origin_of(const HeldSample& held) const noexcept {
  const shm::OutputSegment& from = held_from_[held.hold]->segment;
  const auto offset = reinterpret_cast<std::uintptr_t>(held.data) -
                      reinterpret_cast<std::uintptr_t>(from.payload(0));
  const std::uint64_t slot = offset / from.layout().stride;
  if (slot >= from.layout().slot_count) return copies_.origin(held.hold);
  return from.slot_header(static_cast<std::uint32_t>(slot)).origin();
}

// Of a publisher that is gone, with its last sample. The service thread unmaps it.
void InputCore::let_go_of(const OutputPeer* peer) noexcept {
  if (peer->held != 0) return;
  const auto kept = std::find_if(
      lingering_.begin(), lingering_.end(),
      [&](const std::unique_ptr<InputView>& view) { return view->links[0].peer.get() == peer; });
  if (kept == lingering_.end()) return;
  handover_.retire(std::move(*kept));
  lingering_.erase(kept);
  memory_->service_bell().ring();
}

}  // namespace arbiter::detail
