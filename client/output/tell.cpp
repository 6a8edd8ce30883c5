// What the port's thread tells taps of its arrivals.
#include <algorithm>

#include "client/output/output_core.hpp"

namespace arbiter::detail {

// What is so now, with nothing that has happened.
shm::EventRecord OutputCore::state() const noexcept {
  shm::EventRecord record;
  record.kind = shm::EventKind::kState;
  record.time = std::max(last_, shm::Nanoseconds{0});
  record.sample = shm::make_entry(sequence_ & shm::kSequenceMask, shm::kNoSampleSlot);
  record.activity = own_word_;
  record.generation = snapshot_.generation;
  return record;
}

// What has become of the arrival under way.
shm::Masks OutputCore::masks() noexcept {
  shm::Masks masks;
  masks.refused = teller_.refusals();
  for (const Destination& destination : destinations_) {
    const bool is_met = destination.joined || destination.refused || destination.awaited;
    if (!destination.has_rule || !is_met) continue;
    switch (decisions_[destination.decision].verdict) {
      case shm::Verdict::kWins:
        (destination.joined    ? masks.accepted
         : destination.awaited ? masks.blind
                               : masks.refused) |= destination.mask;
        break;
      case shm::Verdict::kLoses:
        masks.discarded |= destination.mask;
        break;
      default:
        masks.blind |= destination.mask;
    }
  }
  masks.accepted &= ~masks.refused;
  return masks;
}

// The event comes after the receivers have been woken: what a tap costs, none of them waits for.
Counts OutputCore::hand_over_and_tell(std::uint32_t slot, std::size_t size, bool begins) noexcept {
  decide_all(last_);
  const Counts outcome = hand_over(slot, size, last_);
  if (begins) ring_where_selection_changed();
  tell_arrival(slot);
  return outcome;
}

void OutputCore::tell_arrival(std::uint32_t slot) noexcept {
  shm::EventRecord record = state();
  record.masks = masks();
  record.kind = shm::EventKind::kSignal;
  if (slot != shm::kNoSlot) {
    record.kind = shm::EventKind::kSample;
    record.sample = shm::make_entry(sequence_ & shm::kSequenceMask, slot);
    record.size = segment_.slot_header(slot).size.load(std::memory_order_relaxed);  // our own store
    pool_.add_reference(slot);
    const std::uint32_t evicted = teller_.keep(record.sample);
    if (evicted != shm::kNoSlot) pool_.evict(evicted);
  }
  teller_.tell(record, origin_);
}

void OutputCore::tell_deactivation() noexcept {
  shm::EventRecord record = state();
  record.kind = shm::EventKind::kDeactivation;
  teller_.tell(record);
}

}  // namespace arbiter::detail
