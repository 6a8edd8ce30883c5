// publish(), signal() and deactivate(): what becomes of an arrival.
//
//   stamp     the source's activity; from here on everybody sees it
//   decide    at each connected port
//   hand over to the queues of those where it wins, and ring for those that wait
//   ring      where the activity's beginning or end changed the selection without a sample
//
// What is called here is one of the two places that assert nothing: it is the hottest, and each
// check would be paid again for each connection, or slot. The other is take_once() of an input
// port. What both do to the accounts is asserted around them: where a loan ends that is not
// published (cores.cpp), a sample is given back, a queue is joined, and the port ends.
#include <algorithm>
#include <cstring>

#include "client/count.hpp"
#include "client/output/output_core.hpp"
#include "shm/port_picture.hpp"
#include "shm/prefetch.hpp"

namespace arbiter::detail {

// A large sample is written to the slot that was used last: round all slots of a queue that nothing
// waits in, each would be written after it has left the cache. A small one does not pay for a look
// at what receivers write.
std::uint32_t OutputCore::acquire_slot(std::size_t size) noexcept {
  const bool is_large = size >= smallest_large;
  if (is_large) forget_consumed();
  const auto each_hold = [&](auto&& each) {
    // SYNC POINT: kept-sample-held. Fence (b) for what is kept for taps, here and not in each
    // publish: between what has given way and our reading of holds. Pairs with fence (e) of a tap.
    if (!teller_.seats().empty()) shm::full_fence();
    for (const TapSeat& seat : teller_.seats())
      each(seat.peer->segment->holds, seat.peer->max_held);
    for (const Destination& destination : destinations_) {
      each(destination.peer->segment->header.holds, destination.peer->max_held);
    }
  };
  const std::uint32_t slot = pool_.acquire(instance_, each_hold, is_large);
  // Its last receiver has it in its cache: let it come back while the sample is written.
  if (slot != shm::kNoSlot) shm::prefetch_to_write(&segment_.slot_header(slot));
  return slot;
}

[[gnu::noinline]] void OutputCore::forget_consumed() noexcept {
  for (Destination& destination : destinations_) {
    const shm::Lane* const lane = destination.joined ? lane_of(destination) : nullptr;
    if (lane == nullptr) continue;
    destination.writer.forget(lane->consumed, [&](std::uint32_t slot) { pool_.evict(slot); });
  }
}

LoanedSlot OutputCore::loan(std::size_t size) noexcept {
  if (handover_.has_offer()) accept_view();
  if (size > type_.size || loans_ == max_loans_) return {};
  const std::uint32_t slot = acquire_slot(size);
  if (slot == shm::kNoSlot) {
    count(segment_.header().counters.no_slot);
    return {};
  }
  ++loans_;
  return {segment_.payload(slot), slot};
}

void OutputCore::end_loan(std::uint32_t slot) noexcept {
  --loans_;
  pool_.end_loan(slot);
}

// SYNC POINT: stamped. Fence (a) stands between our stamp and our reading of other stamps, and
// before publish() returns. It pairs with fence (a) of other publishers (of two that override each
// other, at least one sees the other), with fence (d) of a receiver about to wait, and gives the
// guarantee that no take() which begins after publish() has returned misses the stamp.
void OutputCore::stamped(shm::ActivityWord word) noexcept {
  own_word_ = word;
  shm::full_fence();
}

[[gnu::always_inline]] bool OutputCore::begin_arrival(shm::Nanoseconds now) noexcept {
  if (handover_.has_offer()) accept_view();
  if (!is_settled()) settle();
  const bool begins = !shm::is_active(own_word_, now);
  const shm::ActivityWord word = shm::arrival(now, timeout_);
  activity_->write(word, begins, now);
  stamped(word);
  last_ = now;
  return begins;
}

Counts OutputCore::arrive(std::uint32_t slot, std::size_t size, shm::Nanoseconds now) noexcept {
  const bool begins = begin_arrival(now);
  Counts outcome;
  if (teller_.is_on()) [[unlikely]] {
    outcome = hand_over_and_tell(slot, size, begins);
  } else if (!destinations_.empty()) {
    decide_all(now);
    outcome = hand_over(slot, size, now);
    if (begins) ring_where_selection_changed();
  }
  auto& counters = segment_.header().counters;
  count(slot == shm::kNoSlot ? counters.signals : counters.published);
  return outcome;
}

// A model comes into force once its connections have been offered to us: under its table they
// count, be it that we looked for them a moment too early. Relaxed is enough for that look: the
// table was acquired, and was put in force after the offer.
void OutputCore::bind_rules_and_view() noexcept {
  bind_rules();
  while (handover_.has_offer()) {
    accept_view();
    bind_rules();
  }
  if (has_awaited_) join_awaited();
}

// The same, where the clock may have been read before that model came into force: then a decision
// at that time would combine it with what was so under another, and T would not tell when a word
// was written (shm/decision.hpp). So no rule is bound yet, and the decision that comes next is made
// not to count: it is taken anew, with them and by a later reading.
void OutputCore::rebind_view() noexcept {
  bind_table();
  while (handover_.has_offer()) {
    accept_view();
    bind_table();
  }
  decisions_.clear();
  snapshot_.epoch = kNotInForce;
}

[[gnu::always_inline]] inline void OutputCore::decide_by(shm::DecisionClock clock) noexcept {
  for (SharedDecision& decision : decisions_) {
    decision.verdict = decision.bound.decide(snapshot_.table, clock);
  }
}

// Flat, for two callers of a rule's decision are one too many for the compiler to inline it.
[[gnu::flatten]] void OutputCore::decide_all(shm::Nanoseconds now) noexcept {
  decide_by(shm::DecisionClock(now, true));
  if (!memory_->tables().is_in_force(snapshot_)) decide_anew(now);
}

[[gnu::noinline, gnu::cold]] void OutputCore::decide_anew(shm::Nanoseconds now) noexcept {
  for (int tries = 0; tries < kMaxTableRetries; ++tries) {
    bind_rules_and_view();
    decide_by(shm::DecisionClock(now, false));
    if (memory_->tables().is_in_force(snapshot_)) return;
  }
  for (SharedDecision& decision : decisions_) decision.verdict = shm::Verdict::kUnsettled;
}

Counts OutputCore::hand_over(std::uint32_t slot, std::size_t size, shm::Nanoseconds now) noexcept {
  Counts outcome;
  const bool is_sample = slot != shm::kNoSlot;
  if (is_sample) {
    shm::SlotHeader& header = segment_.slot_header(slot);
    header.sequence.store(++sequence_, std::memory_order_relaxed);
    header.stamp.store(now, std::memory_order_relaxed);
    header.size.store(size, std::memory_order_relaxed);
  }
  std::uint64_t blind = 0;
  std::uint64_t unsettled = 0;
  for (Destination& destination : destinations_) {
    if (!destination.joined) {
      if (!destination.refused && !destination.awaited) continue;
      const Counts missed =
          destination.refused ? refuse(destination, is_sample) : pass_over(destination, is_sample);
      outcome.discarded += missed.discarded;
      outcome.refused += missed.refused;
      continue;
    }
    if (!destination.has_rule) {
      destination.verdict = shm::Verdict::kLoses;
      continue;
    }
    destination.verdict = decisions_[destination.decision].verdict;
    blind += destination.verdict == shm::Verdict::kBlind;
    unsettled += destination.verdict == shm::Verdict::kUnsettled;
    if (destination.verdict != shm::Verdict::kWins) {
      ++outcome.discarded;
      if (is_sample) count(destination.writer.channel().discarded, 1);
      continue;
    }
    if (!is_sample) continue;
    if (destination.peer->refuse_new && is_full(destination)) {
      destination.verdict = shm::Verdict::kLoses;  // nothing to ring for
      ++outcome.refused;
      teller_.note_refusal(destination.mask);
      count(destination.writer.channel().refused, 1);
      continue;
    }
    ++outcome.delivered;
    pool_.add_reference(slot);
    const std::uint32_t evicted = destination.writer.push(slot);
    if (evicted != shm::kNoSlot) pool_.evict(evicted);
  }
  if (outcome.delivered != 0) {
    // SYNC POINT: entry-announced. Fence (b), between our entries and our reading of wait words and
    // holds. Pairs with fence (d) of a receiver about to wait: either it sees the entry, or we see
    // it wait; and with fence (c) of a receiver that takes hold (channel.hpp).
    shm::full_fence();
    for (Destination& destination : destinations_) {
      if (destination.joined && destination.verdict == shm::Verdict::kWins)
        ring_if_waiting(destination);
    }
  }
  auto& counters = segment_.header().counters;
  if (is_sample) {
    count(counters.delivered, outcome.delivered);
    count(counters.discarded, outcome.discarded);
    count(counters.refused, outcome.refused);
  }
  if (blind != 0) {
    count(counters.blind, blind);
    if (blindness_.begins()) memory_->service_bell().ring();
  }
  count(counters.unsettled, unsettled);
  return outcome;
}

// What becomes of an arrival at a port whose connection is refused: it may be the winner there, but
// is never handed over.
Counts OutputCore::refuse(const Destination& destination, bool is_sample) const noexcept {
  Counts outcome;
  if (!destination.has_rule) return outcome;
  const bool wins = decisions_[destination.decision].verdict == shm::Verdict::kWins;
  outcome.discarded = wins ? 0 : 1;
  outcome.refused = wins && is_sample ? 1 : 0;
  return outcome;
}

// What becomes of it at a port whose process has not taken up the connection yet.
Counts OutputCore::pass_over(Destination& destination, bool is_sample) noexcept {
  Counts outcome;
  if (!destination.has_rule) return outcome;
  outcome.discarded = 1;
  if (is_sample) ++destination.missed;
  auto& counters = segment_.header().counters;
  switch (decisions_[destination.decision].verdict) {
    case shm::Verdict::kWins:
    case shm::Verdict::kBlind:
      count(counters.blind);
      break;
    case shm::Verdict::kUnsettled:
      count(counters.unsettled);
      break;
    case shm::Verdict::kLoses:
      break;
  }
  return outcome;
}

// The receiver's lane for us tells how far it has read; null: it has none yet.
// SYNC POINT: lane-given. The acquire pairs with the release in InputCore::accept_view(): who finds
// its link in a lane, whose number never comes back, finds no earlier link's count in it, be it of
// another publisher or of its own.
const shm::Lane* OutputCore::lane_of(Destination& destination) const noexcept {
  const auto is_ours = [&](const shm::Lane& lane) {
    return lane.link.load(std::memory_order_acquire) == destination.link;
  };
  if (destination.lane == nullptr || !is_ours(*destination.lane)) {
    destination.lane = nullptr;
    for (const shm::Lane& lane : destination.peer->segment->lanes) {
      if (is_ours(lane)) destination.lane = &lane;
    }
  }
  return destination.lane;
}

// Until the receiver has a lane for us, it has read nothing. Relaxed is enough for its count: it
// says what may be pushed; what may be written, the holds say.
bool OutputCore::is_full(Destination& destination) const noexcept {
  const shm::Lane* const lane = lane_of(destination);
  const std::uint64_t nothing_read =
      destination.writer.channel().first.load(std::memory_order_relaxed) - 1;
  const std::uint64_t consumed =
      lane == nullptr ? nothing_read : lane->consumed.load(std::memory_order_relaxed);
  if (consumed > destination.writer.accepted() &&
      !destination.peer->misbehaved.exchange(true, std::memory_order_relaxed)) {
    memory_->service_bell().ring();
  }
  return destination.writer.is_full(std::max(consumed, nothing_read));
}

// Relaxed is enough for the wait word: fence (b) comes before, and nothing is read by it.
void OutputCore::ring_if_waiting(Destination& destination) noexcept {
  const std::uint64_t wait = destination.peer->segment->header.wait.load(std::memory_order_relaxed);
  if ((wait & 1) == 0 || wait == destination.rung) return;
  destination.rung = wait;
  destination.peer->ringer.ring();
}

// Our activity has begun or ended. A component that waits, and believes of its port what is no
// longer so, is woken: to stop its motor, or to know when it will have to. What it believes is of
// its own time, so the clock is read again: by our arrival's time, an activity that has ended since
// would still be active.
void OutputCore::ring_where_selection_changed() noexcept {
  for (Destination& destination : destinations_) {
    const std::uint64_t wait =
        destination.peer->segment->header.wait.load(std::memory_order_relaxed);
    if ((wait & 1) == 0 || wait == destination.rung) continue;
    if (selection_differs(destination)) ring_if_waiting(destination);
  }
}

bool OutputCore::selection_differs(const Destination& destination) noexcept {
  const shm::SourceId believed =
      destination.peer->segment->header.believed.load(std::memory_order_relaxed);
  shm::PortPicture picture;
  picture.bind(snapshot_.table, destination.peer->port, memory_->pages());
  shm::DecisionClock clock(0, false);
  if (!picture.take(clock)) return true;
  const auto selection = picture.selection();
  // What is not known here, let it look at for itself.
  if (!selection.is_sure || selection.rule.source != believed) return true;
  // Nor does it know when our activity, which has begun, will run out: where alternatives keep it
  // selected, that may change the selection, and nobody rings then.
  return selection.rule.kind != shm::table::kConjunction && shm::is_finite(own_word_) &&
         shm::reads(selection.rule, source_);
}

Counts OutputCore::publish_loan(std::uint32_t slot, std::size_t size,
                                shm::Nanoseconds now) noexcept {
  const Counts outcome = arrive(slot, size, now);
  end_loan(slot);
  return outcome;
}

// Who takes the sample is decided once, and before the bytes are written: whoever joins from here
// on reads no entry that was there before it (channel.hpp, invariant 4). A tap decides nothing, and
// is told of each sample.
Published OutputCore::publish_late_bytes(const LateBytes& bytes, shm::PortInstance knower,
                                         shm::Nanoseconds deadline, std::uint32_t slot,
                                         std::size_t size, shm::Nanoseconds now) noexcept {
  if (now > deadline) {
    end_loan(slot);
    return {be_late(), 0};
  }
  const bool begins = begin_arrival(now);
  Counts outcome;
  if (teller_.is_on()) {
    bytes.write(bytes.called);
    outcome = hand_over_and_tell(slot, size, begins);
  } else if (!destinations_.empty()) {
    decide_all(now);
    if (wins_beside(knower)) bytes.write(bytes.called);
    outcome = hand_over(slot, size, now);
    if (begins) ring_where_selection_changed();
  }
  count(segment_.header().counters.published);
  end_loan(slot);
  return {outcome, outcome.delivered == 0 ? 0 : sequence_};
}

bool OutputCore::wins_beside(shm::PortInstance receiver) const noexcept {
  return std::any_of(destinations_.begin(), destinations_.end(), [&](const Destination& each) {
    return each.joined && each.has_rule && each.peer->instance != receiver &&
           decisions_[each.decision].verdict == shm::Verdict::kWins;
  });
}

Counts OutputCore::publish_copy(const void* data, std::size_t size, shm::Nanoseconds now) noexcept {
  if (handover_.has_offer()) accept_view();
  const std::uint32_t slot = acquire_slot(size);
  if (slot == shm::kNoSlot) {
    count(segment_.header().counters.no_slot);
    return signal(now);  // it did arrive
  }
  if (size != 0) std::memcpy(segment_.payload(slot), data, size);
  const Counts outcome = arrive(slot, size, now);
  pool_.end_loan(slot);
  return outcome;
}

Counts OutputCore::signal(shm::Nanoseconds now) noexcept { return arrive(shm::kNoSlot, 0, now); }

bool OutputCore::wants_samples() const noexcept {
  if (!is_settled()) return true;
  const bool is_read = std::any_of(teller_.seats().begin(), teller_.seats().end(),
                                   [](const TapSeat& seat) { return seat.peer->max_held != 0; });
  return is_read ||
         std::any_of(destinations_.begin(), destinations_.end(), [&](const Destination& each) {
           if (!each.has_rule || (!each.joined && !each.refused)) return false;
           return each.peer->keep || decisions_[each.decision].verdict != shm::Verdict::kLoses;
         });
}

void OutputCore::deactivate(shm::Nanoseconds now) noexcept {
  if (handover_.has_offer()) accept_view();
  if (!rules_are_bound()) bind_rules();
  const bool ends = shm::is_active(own_word_, now);
  activity_->deactivate(now);
  stamped(activity_->word.load(std::memory_order_relaxed));
  last_ = now;
  if (teller_.is_on()) tell_deactivation();
  if (ends) ring_where_selection_changed();
}

}  // namespace arbiter::detail
