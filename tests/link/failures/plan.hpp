// What one round consists of: hosts, their models, and what befalls them when. All of it follows
// from the seed.
#pragma once

#include <array>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "tests/link/failures/relay.hpp"

namespace arbiter::failures {

struct Options {
  std::uint64_t seed = 0;
  double seconds = 60;
  unsigned hosts = 0;   // 3 to 5; 0: each round another number
  unsigned rate = 100;  // samples of each source, a second
  std::string keep;     // where recordings and logs of a round with findings are left
  std::string commit = "unknown";
  bool has_bounds =
      false;              // who comes back must do so in time, where the machine let it (waits.hpp)
  bool is_short = false;  // one round for a test: its troubles last for less
  std::set<std::string> only;  // the names of the troubles that happen; empty: all
};

// The models of each host. All but one host have the last one, so nobody ever switches to it.
inline constexpr std::array<const char*, 3> kModels{"default", "other", "rare"};

// How long sources are active after a sample, at one host.
inline constexpr Nanoseconds kForever = 0;
struct HostPlan {
  // By model, and by the number of the host whose source it is.
  std::array<std::vector<Nanoseconds>, kModels.size()> timeouts;
  // The sources that the motor obeys, the first of them that is active; by model.
  std::array<std::vector<unsigned>, kModels.size()> orders;
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
  host_kill,      // all of it, as by a power cut
  switch_death,   // another host's link is killed between prepare and commit
  rival,          // the shared source is opened on this host, or closed, for a while
  switch_all,     // `arbiter switch NAME --all` on this host
  switch_cannot,  // the same, to a model that one host does not have
  switch_twice,   // on this host and on another at once, to different models
};
inline constexpr unsigned kTroubles = 19;
[[nodiscard]] const char* name_of(Trouble trouble) noexcept;

// What befalls frames, processes of a host (one such trouble at a time), or neither.
[[nodiscard]] constexpr bool is_of_frames(Trouble trouble) { return trouble < Trouble::unplugged; }
[[nodiscard]] constexpr bool is_of_processes(Trouble trouble) {
  return trouble >= Trouble::unplugged && trouble <= Trouble::switch_death;
}
[[nodiscard]] constexpr bool is_cut(Trouble trouble) {
  return trouble == Trouble::cut || trouble == Trouble::mute || trouble == Trouble::deaf ||
         trouble == Trouble::split;
}
[[nodiscard]] constexpr bool is_of_all(Trouble trouble) {
  return trouble == Trouble::split || trouble == Trouble::all_noise;
}

struct Event {
  Nanoseconds at = 0;     // since the round's beginning
  Nanoseconds lasts = 0;  // from its beginning to its end, or until what was killed comes back
  Trouble trouble{};
  unsigned host = 0;
  Fault fault;             // of noise, and of a slow network
  unsigned other = 0;      // of a switch: the second operator's host; of its death: the operator's
  unsigned model = 0;      // of a switch: which of kModels
  bool is_abrupt = false;  // of a rival: it is killed, and does not close its port
};

struct Plan {
  std::uint64_t seed = 0;
  Nanoseconds lasts = 0;
  Nanoseconds period = 0;       // of samples
  std::vector<HostPlan> hosts;  // by number - 1
  unsigned late_host = 0;       // whose interface comes after its link; 0: none
  unsigned host_without = 0;    // which has not the last of the models
  bool has_losers = false;      // large samples that lose stay at home: no recorder takes them
  std::set<unsigned> speakers;  // hosts that have the shared source open from the beginning
  std::vector<Event> events;    // by time

  [[nodiscard]] std::string model_text(unsigned host, unsigned model) const;
  [[nodiscard]] std::string text() const;  // for people, a line for each event
};

// How old a sample of a `forever` source may be: the models' timeout. It is T of the shared source.
inline constexpr Nanoseconds kModelTimeout = 300'000'000;

[[nodiscard]] Plan make_plan(const Options& options, std::uint64_t seed);

}  // namespace arbiter::failures
