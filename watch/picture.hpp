// One consistent picture of activities, as decisions take it, and who wins in it.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "shm/activity.hpp"
#include "shm/decision_memory.hpp"
#include "shm/ids.hpp"
#include "shm/table_ring.hpp"

namespace arbiter::watch {

struct Picture {
  shm::TableSnapshot snapshot;  // the model in force; generation 0: none
  shm::Nanoseconds now = 0;     // CLOCK_MONOTONIC: the moment that it is of
  // Of each source that was asked for; kNeverActive of one that has no page here yet.
  std::map<shm::SourceId, shm::ActivityWord> words;
  // Since when these are active, or were until their ends, where that is known.
  std::map<shm::SourceId, shm::Nanoseconds> began;
  std::vector<shm::SourceId> unseen;  // these, ascending
  bool is_settled = true;  // else sources changed too fast for one picture: it mixes moments

  [[nodiscard]] bool is_active(shm::SourceId source) const {
    const auto found = words.find(source);
    return found != words.end() && shm::is_active(found->second, now);
  }
  // Since its last arrival or deactivation; nothing: it had none.
  [[nodiscard]] std::optional<shm::Nanoseconds> age_of(shm::SourceId source) const;
  [[nodiscard]] std::optional<shm::Nanoseconds> beginning_of(shm::SourceId source) const;
  // When what happened to a source last did happen, as event_time() has it; now, if it is not of
  // the picture, as where a table that is being overwritten names any.
  [[nodiscard]] shm::Nanoseconds changed_at(shm::SourceId source) const;
  // Since when the port has selected what it does, where that was another source in the picture
  // `before`, by the same model.
  [[nodiscard]] shm::Nanoseconds selected_since(const Picture& before, shm::PortId port) const;
  [[nodiscard]] bool is_unseen(shm::SourceId source) const;
  // The source that the port selects by the rules; kNone: none, or the port is not arbitrated. The
  // picture must be of all sources that the port heeds.
  [[nodiscard]] shm::SourceId winner_at(shm::PortId port) const;
  // When the first of the activities ends by itself; kForever: none does.
  [[nodiscard]] shm::Nanoseconds next_end() const;
};

// Which sources the picture is to be of, by the table that is in force.
using SourcesOf = std::function<std::vector<shm::SourceId>(const shm::TableView&)>;

// Wait-free: at most shm::kMaxPictures tries, then a picture that is not settled.
[[nodiscard]] Picture take_picture(const shm::DecisionMemory& memory, const SourcesOf& sources_of);

// Whether its page has come; one that has never had a page has never been active. Until it has, the
// picture says nothing of it.
[[nodiscard]] bool sees(const shm::DecisionMemory& memory, const Picture& picture,
                        shm::SourceId source);
// The same of all that the port heeds.
[[nodiscard]] bool sees_port(const shm::DecisionMemory& memory, const Picture& picture,
                             shm::PortId port);

// All sources that a port is connected to or reads.
[[nodiscard]] SourcesOf sources_at(shm::PortId port);
// All that the model mentions.
[[nodiscard]] std::vector<shm::SourceId> all_sources(const shm::TableView& table);

}  // namespace arbiter::watch
