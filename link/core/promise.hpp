// What this host has promised to those who switch the model of all hosts: at most one thing at a
// time, and for two seconds at most. Whoever was promised a switch and asks for it in time gets it;
// after that, or from anybody else, the question comes too late.
//
//   free ── promise() ──▶ promised ── keep() by whom it was promised to ──▶ free: switch now
//    ▲                       │ release() by the same; or 2 s have gone by
//    └───────────────────────┘
//
// A promise that comes to nothing keeps all others away meanwhile. So each asker (a link, in one of
// its lives) may have them for no more than kHolds in sum within kWithin: who prepares over and
// over and never commits is refused, while others are heard.
//
// Units: nanoseconds of a monotonic clock. Thread safety: none of its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "link/core/held_tokens.hpp"
#include "shm/activity.hpp"

namespace arbiter::link {

// One attempt to switch: of which link, in one of its lives, and a number that it has chosen.
struct SwitchAttempt {
  Incarnation asker = 0;
  std::uint64_t number = 0;

  friend bool operator==(const SwitchAttempt&, const SwitchAttempt&) = default;
};

class Promise {
 public:
  static constexpr shm::Nanoseconds kHolds = 2'000'000'000;
  static constexpr shm::Nanoseconds kWithin = 10'000'000'000;
  static constexpr std::size_t kMostAskers = 64;

  enum class Verdict : std::uint8_t {
    kFree,
    kBusy,     // promised to another attempt
    kTooMuch,  // of what was promised to this asker, too much came to nothing
  };
  [[nodiscard]] Verdict judge(const SwitchAttempt& attempt, shm::Nanoseconds now);
  // Where judge() has said kFree. To whom it was promised already it is promised from now on.
  void promise(const SwitchAttempt& attempt, const std::string& model, shm::Nanoseconds now);
  // The model that was promised, which is to be switched to now. Nothing: none was, to this
  // attempt, or it was too long ago.
  [[nodiscard]] std::optional<std::string> keep(const SwitchAttempt& attempt, shm::Nanoseconds now);
  void release(const SwitchAttempt& attempt, shm::Nanoseconds now);

  [[nodiscard]] bool is_promised(shm::Nanoseconds now);

 private:
  struct Promised {
    SwitchAttempt to;
    std::string model;
    shm::Nanoseconds since = 0;
  };
  // For how long an asker has held others up; it grows less as time goes by.
  struct Debt {
    shm::Nanoseconds amount = 0;
    shm::Nanoseconds as_of = 0;
  };
  void let_expire(shm::Nanoseconds now);
  void charge(Incarnation asker, shm::Nanoseconds held, shm::Nanoseconds now);
  static shm::Nanoseconds rest_of(const Debt& debt, shm::Nanoseconds now);

  std::optional<Promised> promised_;
  std::map<Incarnation, Debt> debts_;
};

}  // namespace arbiter::link
