// How explanations are told: in words and as JSON.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "rules/explain/explain.hpp"
#include "shm/activity.hpp"

namespace arbiter::cli {

// What is known of a source at the time of the explanation.
struct SourceState {
  shm::ActivityWord word = shm::kNeverActive;
  shm::Nanoseconds timeout = shm::kDefaultTimeout;
  bool is_visible = true;       // else the daemon has no page of its activity yet
  std::string timeout_place{};  // "model.xml:3", "default"; empty: not to be told
  // Of a source whose T is another than before: which it was, and until when.
  std::optional<shm::Nanoseconds> timeout_before{};
  shm::Nanoseconds timeout_changed = 0;
  shm::ActivityWord word_at_change = shm::kNeverActive;

  // Nothing where it cannot be told, because T may have been another one then.
  [[nodiscard]] std::optional<shm::Nanoseconds> last_arrival() const;
  // In that case: when it was at the latest.
  [[nodiscard]] std::optional<shm::Nanoseconds> arrived_by() const;
};

// The activities that an explanation is about.
class Sources {
 public:
  void set(const std::string& name, const SourceState& state) { states_[name] = state; }
  void set_time(shm::Nanoseconds now) { now_ = now; }

  [[nodiscard]] shm::Nanoseconds now() const { return now_; }
  [[nodiscard]] SourceState state(const std::string& name) const;
  [[nodiscard]] bool is_active(const std::string& name) const {
    return shm::is_active(state(name).word, now_);
  }
  // "active (arrived 40 ms ago, T 500ms)", "inactive (last arrival 3.2 s ago, T 500ms)".
  [[nodiscard]] std::string describe(const std::string& name) const;
  [[nodiscard]] nlohmann::json to_json(const std::string& name) const;

 private:
  [[nodiscard]] std::string ending_text(const SourceState& source) const;
  [[nodiscard]] std::string ended_text(const SourceState& source) const;

  std::map<std::string, SourceState> states_;
  shm::Nanoseconds now_ = 0;
};

// 3 200 000 000 -> "3.2 s".
std::string span_text(shm::Nanoseconds span);

// In one line, without the name of the connection: "inhibited by …".
std::string cause_text(const rules::Cause& cause, const Sources& sources);
nlohmann::json cause_json(const rules::Cause& cause);
// The same without activities, and without whose it is: "inhibited by behaviour "X" (m.xml:9)".
std::string headline(const rules::Cause& cause);

// The first of what keeps a connection out, in one line; of one that has several behaviours, that
// of the first.
std::string first_cause(const rules::ConnectionExplanation& connection, const Sources& sources);

// "inhibited by …", "out: …": why one that had won does not any more, though it is active; empty
// where it is not active, or not told of.
std::string loss_text(const rules::PortExplanation& port, const std::string& loser,
                      const Sources& sources);

// What of the rules keeps it out, a line each, indented; of each behaviour at most so many lines,
// and one that says how many more there are.
void write_causes(std::ostream& out, const rules::ConnectionExplanation& connection,
                  const Sources& sources, std::size_t max_lines);
nlohmann::json connection_json(const rules::ConnectionExplanation& connection,
                               const Sources& sources);

// "/Face/pos:o arrived", "/Object/pos:o went inactive, 500 ms after its last arrival".
std::string event_text(const std::string& source, const SourceState& state, shm::Nanoseconds now);
// "active", "expired", "deactivated", and when it became so; of a beginning, when it last arrived.
nlohmann::json event_json(const std::string& source, const SourceState& state,
                          shm::Nanoseconds now);
// When a source has last changed, as its word tells.
shm::Nanoseconds event_time(const SourceState& state, shm::Nanoseconds now);

}  // namespace arbiter::cli
