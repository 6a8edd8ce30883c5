// Arrivals that must not be late, and arrivals whose time is given.
#include <algorithm>
#include <string>

#include "client/count.hpp"
#include "client/output/output_core.hpp"

namespace arbiter::detail {

// What comes at the deadline itself is in time.
Outcome OutputCore::publish_loan_by(shm::Nanoseconds deadline, std::uint32_t slot, std::size_t size,
                                    shm::Nanoseconds now) noexcept {
  if (now <= deadline) return publish_loan(slot, size, now);
  end_loan(slot);
  return be_late();
}

Outcome OutputCore::publish_copy_by(shm::Nanoseconds deadline, const void* data, std::size_t size,
                                    shm::Nanoseconds now) noexcept {
  if (now <= deadline) return publish_copy(data, size, now);
  return be_late();
}

Outcome OutputCore::signal_by(shm::Nanoseconds deadline, shm::Nanoseconds now) noexcept {
  if (now <= deadline) return signal(now);
  return be_late();
}

Outcome OutputCore::pass_on_loan(shm::SampleOrigin origin, shm::Nanoseconds deadline,
                                 std::uint32_t slot, std::size_t size,
                                 shm::Nanoseconds now) noexcept {
  // Where it is late the number goes to another sample.
  const std::uint64_t number = sequence_ + 1;
  if (now <= deadline) segment_.slot_header(slot).set_origin(number, origin);
  origin_ = origin;
  const Outcome outcome = publish_loan_by(deadline, slot, size, now);
  origin_ = {};
  // Nor has it used the number where nobody is connected.
  if (sequence_ != number) segment_.slot_header(slot).set_origin(0, {});
  return outcome;
}

Outcome OutputCore::pass_on_signal(shm::SampleOrigin origin, shm::Nanoseconds deadline,
                                   shm::Nanoseconds now) noexcept {
  origin_ = origin;
  const Outcome outcome = signal_by(deadline, now);
  origin_ = {};
  return outcome;
}

// It is decided for the time that it bears. Verdicts may have been found for a later one since:
// they are forgotten.
Outcome OutputCore::publish_signalled(shm::SampleOrigin origin, shm::Nanoseconds deadline,
                                      std::uint32_t slot, std::size_t size,
                                      shm::Nanoseconds now) noexcept {
  Outcome outcome;
  if (now > deadline || last_ == kUnknown || !shm::is_active(own_word_, now)) {
    outcome.late = true;
  } else {
    if (handover_.has_offer()) accept_view();
    rules_are_bound() ? bind_rules_and_view() : rebind_view();
    if (origin.publisher != 0) segment_.slot_header(slot).set_origin(sequence_ + 1, origin);
    origin_ = origin;
    if (teller_.is_on()) {
      outcome = hand_over_and_tell(slot, size, false);
    } else {
      decide_all(last_);
      outcome = hand_over(slot, size, last_);
    }
    origin_ = {};
    count(segment_.header().counters.published);
  }
  end_loan(slot);
  return outcome;
}

Outcome OutputCore::be_late() noexcept {
  count(segment_.header().counters.late);
  Outcome outcome;
  outcome.late = true;
  return outcome;
}

// An arrival at a given time is one whose publisher has read the clock at that time and has been
// held up since. That is all that others see of it, and what they must cope with anyway; so the
// order of the data path is the same. What a reading of the clock warrants must be asked for: it is
// not in the future, and not before the source's last event. Nor at the time of a deactivation: the
// value of the word before that might come back (activity.hpp, invariant 2).
void OutputCore::begin_replay(shm::Nanoseconds at, shm::Nanoseconds now) {
  require_replay();
  const auto refuse = [&](shm::Nanoseconds by, const char* what) {
    throw Error(name_ + ": an arrival at " + std::to_string(at) + " ns is refused: that is " +
                std::to_string(by) + " ns " + what);
  };
  if (at < 0) {
    throw Error(name_ + ": an arrival at " + std::to_string(at) +
                " ns is refused: CLOCK_MONOTONIC begins at 0");
  }
  if (handover_.has_offer()) accept_view();
  // Verdicts were found for times that may be later than `at`: they are forgotten.
  bind_rules_and_view();
  if (last_ == kUnknown) {
    last_ = std::clamp(shm::time_of(own_word_, timeout_), shm::Nanoseconds{0}, now);
  }
  if (at > now) refuse(at - now, "later than now");
  if (at < last_) {
    refuse(last_ - at, "before the last arrival or deactivation of this source");
  }
  if (at == last_ && shm::is_deactivation(own_word_)) {
    refuse(0, "after the last deactivation of this source; later is allowed");
  }
  // Whoever waits has seen our activity end, be it later than `at`: it begins for them.
  if (shm::is_finite(own_word_) && !shm::is_active(own_word_, now)) own_word_ = shm::kNeverActive;
}

void OutputCore::require_replay() const {
  if (!why_no_replay_.empty()) throw Error(name_ + ": " + why_no_replay_);
}

}  // namespace arbiter::detail
