// Round trips between links, without comparing clocks: each link numbers the pulses that it sends,
// four times a second, and each pulse names the newest one of every other link, and for how long it
// has been here. Who finds its own number in it knows the round trip: the time since it sent that,
// less the time that it lay there. Who does not find its newest ones is not heard there.
//
//   pulse  "ARBP", version 1, incarnation of the sender, number (8), how many echoes (2); each:
//          incarnation (8), number (8), nanoseconds since it came (8)
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "link/core/cards.hpp"
#include "link/core/participant.hpp"

namespace arbiter::link {

inline constexpr std::size_t kMaxEchoes = 256;

struct Echo {
  Incarnation of = 0;
  std::uint64_t number = 0;
  std::uint64_t lay = 0;  // nanoseconds
};

struct Pulse {
  Incarnation sender = 0;
  std::uint64_t number = 0;
  std::vector<Echo> echoes;
};

[[nodiscard]] ByteString write_pulse(const Pulse& pulse);
[[nodiscard]] std::optional<Pulse> read_pulse(Bytes bytes);

// What a link knows of round trips. Others are known by whose writers their pulses come from, and
// each has one life: nobody spoils another's round trip, or has more than one place.
//
// Units: nanoseconds of a monotonic clock. Thread safety: none of its own.
class RoundTrips {
 public:
  static constexpr shm::Nanoseconds kPulsePeriod = 250'000'000;
  // Others are not echoed any more who have been silent for so long.
  static constexpr shm::Nanoseconds kSilence = 10'000'000'000;
  // Who has echoed none of so many pulses in a row does not hear this link. That is two seconds in
  // which this link ran: while it is held up it sends none.
  static constexpr std::uint64_t kUnechoed = 8;
  // Who has not pulsed while so many were sent does not pulse any more: kSilence, counted so.
  static constexpr std::uint64_t kUnheard = kSilence / kPulsePeriod;

  explicit RoundTrips(Incarnation me) : me_(me) {}

  // The next pulse, which is sent after this call.
  [[nodiscard]] Pulse next(shm::Nanoseconds now);
  // One that has come. Who does not pulse any more gives way to others; senders that find no place
  // are passed over.
  void note(const Pulse& pulse, const Participant& from, shm::Nanoseconds now);
  // Who is there, of all others: those who were and are no more are forgotten at once, and who has
  // not come yet after kSilence.
  void keep(const std::set<Participant>& there);
  // Those that have pulsed, and do not hear this link, as far as it can know.
  [[nodiscard]] std::set<Participant> deaf() const;
  // Those that pulse; nothing: it is not known, because they are more than find a place.
  [[nodiscard]] std::optional<std::set<Participant>> pulsing() const;
  // The last that was measured; nothing: none.
  [[nodiscard]] std::optional<shm::Nanoseconds> of(const Participant& other) const;

 private:
  static constexpr std::size_t kKept = 16;  // of the pulses that were sent
  struct Other {
    Incarnation life = 0;
    std::uint64_t number = 0;
    shm::Nanoseconds came = 0;
    std::uint64_t came_at = 0;  // our newest, when it came
    std::uint64_t echoed = 0;   // our newest; before the first one that which it could not hear
    bool is_there = false;
    std::optional<shm::Nanoseconds> round_trip;
  };

  [[nodiscard]] bool pulses(const Other& other) const noexcept {
    return last_ - other.came_at < kUnheard;
  }
  bool make_place();

  const Incarnation me_;
  std::uint64_t last_ = 0;
  std::array<shm::Nanoseconds, kKept> sent_{};  // by number
  std::map<Participant, Other> others_;
};

}  // namespace arbiter::link
