#include "evidence/winner_track.hpp"

#include <algorithm>
#include <string_view>
#include <unordered_set>
#include <utility>

#include "shm/port_picture.hpp"

namespace arbiter::evidence {
namespace {

// What comes later than so long after a reading is taken for what came after it.
constexpr Nanoseconds kLatestNews = 60'000'000'000;

}  // namespace

void WinnerTrack::start(Nanoseconds time) {
  now_ = time;
  is_first_ = true;
  rules_.reset();
  words_.clear();
  by_id_.clear();
  names_.clear();
  winners_.clear();
  looked_.clear();
  ends_ = {};
  noted_.clear();
  readings_.clear();
}

void WinnerTrack::set_rules(std::shared_ptr<const RuleTable> rules, std::uint64_t generation,
                            Nanoseconds time) {
  advance(time);
  const auto before = std::exchange(rules_, std::move(rules));
  generation_ = generation;
  names_.clear();
  by_id_.clear();
  looked_.clear();
  if (rules_ != nullptr) {
    for (const auto& [name, id] : rules_->sources) {
      names_[id] = name;
      if (id >= by_id_.size()) by_id_.resize(id + 1);
      const auto word = words_.find(name);
      by_id_[id] = word == words_.end() ? shm::kNeverActive : word->second;
    }
  }
  look_at_all(
      now_, std::exchange(is_first_, false) ? WinnerChange::Why::start : WinnerChange::Why::model);
}

void WinnerTrack::apply(const std::string& source, ActivityWord word, Nanoseconds time,
                        WinnerChange::Why why) {
  advance(time);
  if (is_before_reading(source, word, time, why == WinnerChange::Why::state)) return;
  if (shm::is_active(word, now_)) {
    words_[source] = word;
  } else {
    words_.erase(source);
  }
  note_end(source, word);
  const shm::SourceId id = rules_ == nullptr ? shm::kNone : rules_->source(source);
  if (id == shm::kNone) return;
  const bool was_active = shm::is_active(by_id_[id], now_);
  by_id_[id] = word;
  if (was_active == shm::is_active(word, now_)) return;
  if (why == WinnerChange::Why::state && shm::is_deactivation(word)) {
    const Nanoseconds deactivated = shm::time_of(word, shm::kForever);
    look_where(id, deactivated, WinnerChange::Why::deactivation, source);
  } else {
    look_where(id, time == 0 ? now_ : time, why, source);
  }
}

void WinnerTrack::read(const std::string& source, ActivityWord word) {
  readings_.erase(source);
  const bool is_over = shm::is_deactivation(word);
  apply(source, word, is_over ? shm::time_of(word, shm::kForever) : 0, WinnerChange::Why::state);
  if (word != shm::kNeverActive) note_reading(source, word);
}

void WinnerTrack::join(const std::string& source, ActivityWord word) {
  const Nanoseconds timeout = this->timeout(source);
  const bool has_unknown_time = shm::is_finite(word) && timeout == shm::kForever;
  const Nanoseconds time = has_unknown_time ? now_ : shm::time_of(word, timeout);
  const bool is_told = !shm::is_deactivation(word) && time > now_;
  if (!is_told && !is_before_reading(source, word, time, true)) read(source, word);
}

Nanoseconds WinnerTrack::timeout(const std::string& source) const {
  const shm::SourceId id = rules_ == nullptr ? shm::kNone : rules_->source(source);
  return id == shm::kNone ? shm::kForever : rules_->table.timeout(id);
}

void WinnerTrack::note_reading(const std::string& source, ActivityWord word) {
  readings_.insert_or_assign(source, Reading{word, now_});
  if (readings_.size() <= 2 * kept_readings_) return;
  std::erase_if(readings_,
                [this](const auto& each) { return each.second.at < now_ - kLatestNews; });
  kept_readings_ = std::max(readings_.size(), kFewReadings);
}

// Told late. A state tells of its last arrival, of which nobody may have told. What was read was so
// when it was read, whatever T is by now. Of an activity whose T is not known it is not known when
// it began.
bool WinnerTrack::is_before_reading(const std::string& source, ActivityWord word, Nanoseconds time,
                                    bool is_state) {
  const auto found = readings_.find(source);
  if (found == readings_.end()) return false;
  const Reading& reading = found->second;
  const Nanoseconds timeout = this->timeout(source);
  const auto is_dated = [&](ActivityWord each) {
    return !shm::is_finite(each) || timeout != shm::kForever;
  };
  if (is_state && is_dated(word)) time = std::max(time, shm::time_of(word, timeout));
  const bool is_before =
      is_dated(reading.word) && time < std::min(shm::time_of(reading.word, timeout), reading.at);
  if (!is_before) readings_.erase(found);
  return is_before;
}

// At the moment of its end an activity is over.
void WinnerTrack::advance(Nanoseconds time) {
  while (!ends_.empty() && ends_.top().first <= time) {
    const auto [end, source] = ends_.top();
    ends_.pop();
    const auto noted = noted_.find(source);
    if (noted == noted_.end() || noted->second != end) continue;
    noted_.erase(noted);
    now_ = std::max(now_, end);
    const auto known = words_.find(source);
    const ActivityWord word = known == words_.end() ? shm::kNeverActive : known->second;
    note_end(source, word);
    if (word == end) words_.erase(known);
    const shm::SourceId id = rules_ == nullptr ? shm::kNone : rules_->source(source);
    if (id != shm::kNone && word == end) look_where(id, now_, WinnerChange::Why::expiry, source);
  }
  now_ = std::max(now_, time);
}

// A source has one end to be looked at: the first that there may be. When that comes, it may have
// been renewed.
void WinnerTrack::note_end(const std::string& source, ActivityWord word) {
  if (!shm::is_finite(word) || word <= now_) return;
  const auto [noted, is_new] = noted_.try_emplace(source, word);
  if (!is_new && noted->second <= word) return;
  noted->second = word;
  ends_.emplace(word, source);
}

void WinnerTrack::look_at_all(Nanoseconds time, WinnerChange::Why why) {
  static const std::map<shm::PortId, std::string> no_ports;
  const auto& ports = rules_ == nullptr ? no_ports : rules_->ports;
  std::unordered_set<std::string_view> known;
  for (const auto& [id, name] : ports) known.insert(name);
  std::vector<std::string> gone;
  for (const auto& [port, winner] : winners_) {
    if (known.count(port) == 0) gone.push_back(port);
  }
  for (const std::string& port : gone) {
    tell_({port, "", std::exchange(winners_[port], ""), time, why, "", generation_});
    winners_.erase(port);
  }
  for (const auto& [id, name] : ports) look_at(id, time, why, "");
}

void WinnerTrack::look_where(shm::SourceId source, Nanoseconds time, WinnerChange::Why why,
                             const std::string& by) {
  const shm::WordList ports = rules_->table.ports_concerned(source);
  for (shm::Word i = 0; i < ports.count; ++i) look_at(ports[i], time, why, by);
}

// A port that is not arbitrated has no winner. What is noticed late has changed it at its own time,
// unless something else has mattered there since.
void WinnerTrack::look_at(shm::PortId port, Nanoseconds time, WinnerChange::Why why,
                          const std::string& by) {
  time = std::clamp(time, std::exchange(looked_[port], now_), now_);
  const auto name = rules_->ports.find(port);
  if (name == rules_->ports.end() || !rules_->table.is_arbitrated(port)) return;
  const auto is_active = [this](shm::SourceId source) {
    return source < by_id_.size() && shm::is_active(by_id_[source], now_);
  };
  const shm::SourceId selected = shm::selected_at(rules_->table, port, is_active).source;
  const std::string& winner = name_of_source(selected);
  const auto known = winners_.find(name->second);
  const std::string before = known == winners_.end() ? "" : known->second;
  if (winner == before) return;
  if (winner.empty()) {
    winners_.erase(known);
  } else {
    winners_[name->second] = winner;
  }
  tell_({name->second, winner, before, time, why, by, generation_});
}

const std::string& WinnerTrack::name_of_source(shm::SourceId source) const {
  static const std::string nobody;
  const auto found = names_.find(source);
  return found == names_.end() ? nobody : found->second;
}

}  // namespace arbiter::evidence
