// Looks at what decides, in memory: who wins where, which sources are active, and each change of a
// winner.
//
// It asks nobody. A look costs the components nothing but that lines of memory which they write are
// read, as their receivers read them. A winner that comes and goes between two looks is missed,
// unless a tap of the port tells of it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "top/arrivals.hpp"
#include "top/frame.hpp"
#include "watch/instance.hpp"
#include "watch/pace.hpp"
#include "watch/picture.hpp"

namespace arbiter::top {

// How long between two looks at most.
inline constexpr shm::Nanoseconds kLookInterval = 10'000'000;
// Of its thread's time, looks take one part in so many, however large the model.
inline constexpr shm::Nanoseconds kLookShare = 10;
// How old a census may be and still be told: some three are missing then.
inline constexpr shm::Nanoseconds kCensusHolds = 3'500'000'000;
// And at least, however soon an activity ends.
inline constexpr shm::Nanoseconds kLeastInterval = 1'000'000;

// Thread safety: none; it belongs to the thread of its instance.
class Sampler {
 public:
  // `collect`: what taps have told since it was last called, by time; called at each look, behind
  // the picture.
  explicit Sampler(std::shared_ptr<watch::Instance> instance,
                   std::function<std::vector<Accepted>()> collect = {});

  // Which ports and sources there are.
  void set_census(std::shared_ptr<const Census> census);
  // Takes up the daemon's news and looks. Returns when to look again, at the latest.
  shm::Nanoseconds look();
  // Of the last look; null before the first census. `tapped`: these ports are marked.
  [[nodiscard]] std::shared_ptr<const Frame> frame(
      const std::map<std::string, std::optional<Waits>>& tapped = {}) const;
  // Since the last call, the oldest first.
  [[nodiscard]] std::vector<Takeover> new_takeovers() { return std::exchange(takeovers_, {}); }

 private:
  // What is known of a port's winner.
  struct Seat {
    shm::SourceId winner = shm::kNone;
    bool is_arbitrated = false;
    std::uint64_t generation = 0;  // of the model by which it wins
    shm::Nanoseconds since = 0;
    bool is_exact = false;
  };

  void bind();
  void take_seats();
  [[nodiscard]] Seat seat_at(shm::PortId port) const;
  [[nodiscard]] Seat first_seat(shm::PortId port) const;
  void follow(const std::string& port, Seat& seat, const Accepted& accepted);
  void add_takeover(const std::string& port, shm::SourceId before, shm::SourceId winner,
                    shm::Nanoseconds at, std::string because);
  void note_takeover(const std::string& port, shm::PortId id, const Seat& before, Seat& now);
  [[nodiscard]] std::string cause_of(shm::PortId port, std::uint64_t generation_before,
                                     shm::Nanoseconds& at) const;
  [[nodiscard]] std::string name_of(shm::SourceId source) const;

  const std::shared_ptr<watch::Instance> instance_;
  const std::function<std::vector<Accepted>()> collect_;
  const shm::Nanoseconds started_;
  std::shared_ptr<const shm::DecisionMemory> memory_;
  std::shared_ptr<const Census> census_;
  std::uint64_t memories_ = 0;    // counts them
  std::uint64_t generation_ = 0;  // that sources_ are of
  bool is_bound_ = false;
  std::vector<shm::SourceId> sources_;  // to look at, ascending
  std::vector<shm::PortId> port_ids_;   // of the census; kNone: no name has come
  std::vector<shm::SourceId> source_ids_;
  std::map<shm::SourceId, std::int32_t> places_;  // in the census
  watch::Picture last_;
  watch::Picture before_;
  std::chrono::system_clock::time_point wall_;  // of last_
  std::map<std::string, Seat> seats_;           // by port
  std::map<shm::SourceId, watch::Pace> paces_;
  Arrivals arrivals_;  // that taps told of
  std::uint64_t takeovers_so_far_ = 0;
  std::vector<Takeover> takeovers_;
};

}  // namespace arbiter::top
