// What one round consists of: hosts, their models, and what befalls them when. All of it follows
// from the seed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/link/failures/relay.hpp"

namespace arbiter::failures {

struct Options {
  std::uint64_t seed = 0;
  double seconds = 60;
  unsigned hosts = 0;       // 3 to 5; 0: each round another number
  unsigned rate = 100;      // samples of each source, a second
  std::string keep;         // where recordings and logs of a round with findings are left
  bool has_bounds = false;  // recoveries must be quick: for a machine that does nothing else
  bool is_short = false;    // one round for a test: its troubles last for less
};

// How long sources are active after a sample, at one host.
inline constexpr Nanoseconds kForever = 0;
struct HostPlan {
  std::vector<Nanoseconds> timeouts;  // by the number of the host whose source it is
  // The sources that the motor obeys, the first of them that is active.
  std::vector<unsigned> order;
};

enum class Trouble : std::uint8_t {
  cut,        // the host's cable, both ways
  mute,       // nothing of the host gets out
  deaf,       // nothing gets to it
  split,      // the hosts up to this one do not hear the others, nor are heard
  noise,      // of the host's frames some are lost, doubled, late
  all_noise,  // of all hosts' frames
  slow,       // the host's frames all take longer, both ways
  unplugged,  // the host sees that its interface is down
  host_stop,  // all its processes are stopped, then go on
  link_stop,
  link_kill,
  daemon_kill,
  component_kill,
  host_kill,  // all of it, as by a power cut
};
inline constexpr unsigned kTroubles = 14;
[[nodiscard]] const char* name_of(Trouble trouble) noexcept;

struct Event {
  Nanoseconds at = 0;     // since the round's beginning
  Nanoseconds lasts = 0;  // from its beginning to its end, or until what was killed comes back
  Trouble trouble{};
  unsigned host = 0;
  Fault fault;  // of noise, and of a slow network
};

struct Plan {
  std::uint64_t seed = 0;
  Nanoseconds lasts = 0;
  Nanoseconds period = 0;       // of samples
  std::vector<HostPlan> hosts;  // by number - 1
  unsigned late_host = 0;       // whose interface comes after its link; 0: none
  std::vector<Event> events;    // by time

  [[nodiscard]] std::string model_text(unsigned host) const;
  [[nodiscard]] std::string text() const;  // for people, a line for each event
};

// How old a sample of a `forever` source may be: the models' timeout.
inline constexpr Nanoseconds kModelTimeout = 300'000'000;

[[nodiscard]] Plan make_plan(const Options& options, std::uint64_t seed);

}  // namespace arbiter::failures
