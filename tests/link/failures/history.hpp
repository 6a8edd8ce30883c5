// What befell the hosts of a round, for whoever judges what they recorded.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/link/failures/checker.hpp"
#include "tests/link/failures/plan.hpp"
#include "tests/link/failures/waits.hpp"

namespace arbiter::failures {

// After which a speaker is surely gone of which a host hears nothing, or which hears nothing of it:
// up to 2 s, and up to a second until the link's loop sees to it.
inline constexpr Nanoseconds kSurelyGone = 3 * kSecond;

// Of what has no end yet.
inline constexpr Nanoseconds kLong = 3'600 * kSecond;

// What the status says of what a host gets from another: "published" and "signals", "described".
struct Import {
  std::uint64_t arrived = 0;
  std::string described;
  bool operator==(const Import&) const = default;
};
// Of "host head, 3 lost, 2 late, …": all that has not arrived.
[[nodiscard]] std::uint64_t counted_in(const std::string& described);
// Of "host head, 3 withheld, …": arrivals whose samples have stayed at home.
[[nodiscard]] std::uint64_t withheld_in(const std::string& described);

// For how long a host had the shared source open, or tried to.
struct RivalLife {
  std::uint32_t life = 0;
  Span span;  // to 0: until the end
  bool is_abrupt = false;

  [[nodiscard]] Nanoseconds end() const { return span.to == 0 ? now() : span.to; }
};

struct HostHistory {
  Nanoseconds link_since = 0;
  std::vector<Span> without_link;  // from each death of its link to the next start
  std::vector<RivalLife> rivals;
  std::vector<Import> imports;               // at the end; by the other's number - 1
  std::vector<Nanoseconds> component_lives;  // when each was started
};

// An operator who had all hosts switch.
struct SwitchTried {
  unsigned host = 0;    // where
  unsigned model = 0;   // of kModels
  unsigned victim = 0;  // whose link was killed before the commit; 0: nobody's
  Span span;
  int exit_code = 0;
  std::string report;  // JSON; empty: it had none
};

struct Troubled {
  unsigned host = 0;  // 0: all
  Trouble trouble{};
  Span span;
};

using Direction = std::pair<unsigned, unsigned>;  // from, to

struct History {
  std::map<Direction, std::vector<Span>> cuts;
  std::vector<Troubled> troubled;
  std::vector<HostHistory> hosts;  // by number - 1
  std::vector<SwitchTried> switches;
  Waits waits;
  Nanoseconds until = 0;  // the end of it all

  enum class Of : std::uint8_t { anything, processes };
  // Nothing befell either of the two, or their cables, meanwhile.
  [[nodiscard]] bool is_quiet(unsigned one, unsigned other, const Span& when, Of what) const;
  // How many befell either of them, or their cables, and lasted on after `since`.
  [[nodiscard]] std::uint64_t troubles_of(unsigned one, unsigned other, Nanoseconds since) const;
};

// A rival has the shared source open on that host, or tries to, all the time.
[[nodiscard]] bool is_there(const History& history, unsigned host, const Span& when);

}  // namespace arbiter::failures
