// Who had the output ports open of those who won in a recording.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "evidence/recorded.hpp"

namespace arbiter::cli {

// From a change to the next, or to the end of the run.
struct Reign {
  evidence::WinnerChange change;
  shm::Nanoseconds end = 0;
  bool is_cut_off = false;  // by the end of the run: how long it went on is not known
  bool is_of_last_run = false;
  const evidence::Run* run = nullptr;
};

// More components of one winner are counted: a recording may tell of ever new ones.
constexpr std::size_t kMostComponents = 8;

// Who published what won.
struct Publishers {
  std::vector<const evidence::PortChange*> first;
  std::size_t others = 0;
};

// A component has an output port open. It is seen a little later than it happens.
struct Ownership {
  const evidence::PortChange* opening = nullptr;
  shm::Nanoseconds since = 0;
  shm::Nanoseconds until = shm::kForever;  // none before goes on for longer
};

// Who had a source open.
class Owners {
 public:
  Owners() = default;
  explicit Owners(const std::vector<evidence::PortChange>& changes);

  // A source may win after its component has gone.
  [[nodiscard]] Publishers of(const Reign& reign) const;
  // Of what was seen by then, what was recorded last; null: nothing.
  [[nodiscard]] const evidence::PortChange* last_by(shm::Nanoseconds time) const;

 private:
  const evidence::PortChange* changes_ = nullptr;
  std::vector<shm::Nanoseconds> seen_;  // each of them, or one behind it: the earliest
  std::vector<Ownership> all_;          // `since` and `until` do not fall
};

// Those of each source, found out once for all that it won.
class Components {
 public:
  const Owners& of(const evidence::Run& run, const std::string& source) {
    const auto [known, is_new] = known_.try_emplace({&run, source});
    const auto changes = run.output_changes.find(source);
    if (is_new && changes != run.output_changes.end()) known->second = Owners(changes->second);
    return known->second;
  }
  [[nodiscard]] Publishers of(const Reign& reign) {
    return of(*reign.run, reign.change.winner).of(reign);
  }
  // Who had the source open that went inactive, and died; null: nobody did.
  [[nodiscard]] const evidence::PortChange* death_behind(const Reign& reign) {
    const evidence::WinnerChange& change = reign.change;
    if (change.why != evidence::WinnerChange::Why::expiry) return nullptr;
    const evidence::PortChange* last = of(*reign.run, change.by).last_by(change.time);
    const bool has_died = last != nullptr && last->what == evidence::PortChange::What::died;
    return has_died ? last : nullptr;
  }

 private:
  std::map<std::pair<const evidence::Run*, std::string>, Owners> known_;
};

}  // namespace arbiter::cli
