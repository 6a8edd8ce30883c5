// Since when a port's winner wins, as far as what the sources' activity words say of the past goes.
//
// A word tells the last thing that happened to its source, and beside it stands when its activity
// began, where its publisher has noted that. So the past is known in pieces:
//
//   expired       inactive since the end, which the word is; active before, since it began, or for
//                 T; inactive just before it began; further back nothing is known
//   active        since it began, and inactive just before; or since its last arrival at the latest
//   deactivated   inactive since then at the latest; active just before, since it began, where that
//                 is known
//   never active  always inactive
//
// Going back from one such moment to the one before, the rules are evaluated with what is not known
// left open: as long as the winner wins whatever that was, it has won since then; and where it
// cannot have won whatever that was, it has not. If these two moments are one, the answer is exact.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "shm/activity.hpp"
#include "shm/decision_table.hpp"

namespace arbiter::rules {

enum class Activation : std::uint8_t { kInactive, kActive, kUnknown };

// Whether a rule, its own source included, can hold with what is known.
Activation evaluate(const shm::Rule& rule,
                    const std::function<Activation(shm::SourceId)>& activation);

// All sources that a port is connected to or reads, ascending.
std::vector<shm::SourceId> sources_heeded(const shm::TableView& table, shm::PortId port);

struct Tenure {
  // It has been as it is since this time at least.
  shm::Nanoseconds at_least = 0;
  // It was not so just before this time. The same as at_least where the answer is exact; none where
  // nothing that is known says so.
  std::optional<shm::Nanoseconds> not_before;
  // What happened then: these sources' activity ended or began.
  std::vector<shm::SourceId> changed;

  [[nodiscard]] bool is_exact() const { return not_before == at_least; }
};

struct Moment {
  shm::Nanoseconds now = 0;
  // Further back another model may have been in force.
  shm::Nanoseconds model_since = 0;
  std::function<shm::ActivityWord(shm::SourceId)> word;  // one consistent picture
  // Of a source whose last arrival came under another T than that of the table: when it was at the
  // latest. Empty: there are none.
  std::function<std::optional<shm::Nanoseconds>(shm::SourceId)> arrived_by{};
  // When the activity of a source began of which its word tells. Empty: of none that is known.
  std::function<std::optional<shm::Nanoseconds>(shm::SourceId)> began{};
};

Tenure tenure_of(const shm::TableView& table, shm::PortId port, shm::SourceId winner,
                 const Moment& moment);

}  // namespace arbiter::rules
