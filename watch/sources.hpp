// The activities of sources at one moment, by name.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "shm/activity.hpp"

namespace arbiter::watch {

// What is known of one source.
struct SourceState {
  shm::ActivityWord word = shm::kNeverActive;
  shm::Nanoseconds timeout = shm::kDefaultTimeout;
  bool is_visible = true;       // else the daemon has no page of its activity yet
  std::string timeout_place{};  // "model.xml:3", "default"; empty: not known
  // Of a source whose T is another than before: which it was, and until when.
  std::optional<shm::Nanoseconds> timeout_before{};
  shm::Nanoseconds timeout_changed = 0;
  shm::ActivityWord word_at_change = shm::kNeverActive;
  // When its activity began, though it may be over.
  std::optional<shm::Nanoseconds> began{};
  // How long after this arrival, when T had passed, the next one came, if somebody waited for it.
  std::optional<shm::Nanoseconds> gap{};

  // Nothing where it is not known, because T may have been another one then.
  [[nodiscard]] std::optional<shm::Nanoseconds> last_arrival() const;
  // In that case: when it was at the latest.
  [[nodiscard]] std::optional<shm::Nanoseconds> arrived_by() const;
};

// When what happened to a source last did happen: its deactivation; while it is active, its
// beginning, or where that is not known, its last arrival; its end.
[[nodiscard]] shm::Nanoseconds event_time(const SourceState& state, shm::Nanoseconds now);

class Sources {
 public:
  void set(const std::string& name, const SourceState& state) { states_[name] = state; }
  void set_time(shm::Nanoseconds now) { now_ = now; }

  // CLOCK_MONOTONIC.
  [[nodiscard]] shm::Nanoseconds now() const { return now_; }
  // Of one that nobody has set: it has never been active.
  [[nodiscard]] SourceState state(const std::string& name) const {
    const auto found = states_.find(name);
    return found == states_.end() ? SourceState() : found->second;
  }
  [[nodiscard]] bool is_active(const std::string& name) const {
    return shm::is_active(state(name).word, now_);
  }

 private:
  std::map<std::string, SourceState> states_;
  shm::Nanoseconds now_ = 0;
};

}  // namespace arbiter::watch
