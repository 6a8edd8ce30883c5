// Who wins at each input port, from event to event: told by the rules and by what arrives, is
// deactivated, and ends.
//
// Events come in the order of their times. One that comes late counts from its own time on, unless
// something else has mattered at the port since: then from that on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <queue>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "evidence/records.hpp"
#include "evidence/rule_table.hpp"

namespace arbiter::evidence {

class WinnerTrack {
 public:
  explicit WinnerTrack(std::function<void(WinnerChange&&)> tell) : tell_(std::move(tell)) {}

  // Nothing before it counts.
  void start(Nanoseconds time);
  // These rules decide from now on; null: none do. Tells the winners of all ports that are others
  // than before.
  void set_rules(std::shared_ptr<const RuleTable> rules, std::uint64_t generation,
                 Nanoseconds time);
  // An event at a source, after which its activity is `word`.
  void apply(const std::string& source, ActivityWord word, Nanoseconds time, WinnerChange::Why why);
  // Its page says so, or its publisher, where that begins to tell. What has made it so, or was
  // before, may be told behind it: that changes nothing any more.
  void read(const std::string& source, ActivityWord word);
  // The second. An arrival that is to come yet is told.
  void join(const std::string& source, ActivityWord word);
  // Time has passed.
  void advance(Nanoseconds time);

  [[nodiscard]] Nanoseconds now() const { return now_; }
  // How many sources are active, as far as has been told.
  [[nodiscard]] std::size_t sources() const { return words_.size(); }
  // Of the ports that somebody wins at.
  [[nodiscard]] const std::map<std::string, std::string>& winners() const { return winners_; }

 private:
  void look_at(shm::PortId port, Nanoseconds time, WinnerChange::Why why, const std::string& by);
  void look_at_all(Nanoseconds time, WinnerChange::Why why);
  void look_where(shm::SourceId source, Nanoseconds time, WinnerChange::Why why,
                  const std::string& by);
  void note_end(const std::string& source, ActivityWord word);
  void note_reading(const std::string& source, ActivityWord word);
  [[nodiscard]] bool is_before_reading(const std::string& source, ActivityWord word,
                                       Nanoseconds time, bool is_state);
  [[nodiscard]] Nanoseconds timeout(const std::string& source) const;
  [[nodiscard]] const std::string& name_of_source(shm::SourceId source) const;

  const std::function<void(WinnerChange&&)> tell_;
  std::shared_ptr<const RuleTable> rules_;
  std::uint64_t generation_ = 0;
  bool is_first_ = true;  // no rules have been set since the start
  Nanoseconds now_ = 0;
  std::unordered_map<std::string, ActivityWord> words_;  // of those that are active
  std::vector<ActivityWord> by_id_;
  std::unordered_map<shm::SourceId, std::string> names_;
  std::map<std::string, std::string> winners_;
  std::unordered_map<shm::PortId, Nanoseconds> looked_;  // when something last mattered there
  // When activities may end. Those in noted_ count, one for each source.
  using End = std::pair<Nanoseconds, std::string>;
  std::priority_queue<End, std::vector<End>, std::greater<>> ends_;
  std::unordered_map<std::string, Nanoseconds> noted_;
  // Where nothing has been told of later yet: names may come and go.
  struct Reading {
    ActivityWord word;
    Nanoseconds at;
  };
  static constexpr std::size_t kFewReadings = 1024;
  std::unordered_map<std::string, Reading> readings_;
  std::size_t kept_readings_ = kFewReadings;  // when it was last looked which are old
};

}  // namespace arbiter::evidence
