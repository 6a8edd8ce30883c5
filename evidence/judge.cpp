#include "evidence/judge.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "shm/decision.hpp"

namespace arbiter::evidence {
namespace {

// Of a moment within an interval: so many are tried one by one, of more the interval as a whole.
constexpr std::size_t kMostMoments = 64;

constexpr ActivityWord kActive = shm::kForeverFlag;

// The steps that a source had surely taken before a moment, and those that it may have taken: so
// many of these that it may be in any state, or all.
struct Reached {
  std::size_t surely = 0;
  std::size_t perhaps = 0;
  bool has_more = false;
};

Reached reached(const SourceHistory& history, Nanoseconds from, Nanoseconds to) {
  const auto& steps = history.steps;
  Reached reached;
  reached.surely = static_cast<std::size_t>(
      std::partition_point(steps.begin(), steps.end(),
                           [&](const Step& step) { return step.seen < from; }) -
      steps.begin());
  reached.perhaps = reached.surely;
  while (reached.perhaps < steps.size() && steps[reached.perhaps].time <= to) {
    if (reached.perhaps - reached.surely == kMostSteps) {
      reached.has_more = true;
      break;
    }
    ++reached.perhaps;
  }
  return reached;
}

bool is_known(const SourceHistory& history, const Reached& reached, Nanoseconds to) {
  if (reached.surely == 0 || to >= history.unknown_from) return false;
  const auto& steps = history.steps;
  const std::size_t end = std::min(reached.perhaps + 1, steps.size());
  for (std::size_t i = reached.surely; i < end; ++i) {
    if (steps[i].is_behind_gap) return false;
  }
  return true;
}

}  // namespace

Judge::Judge(const rules::CompiledModel& model, bool with_timeouts)
    : simulation_(model), with_timeouts_(with_timeouts) {}

Nanoseconds Judge::timeout(const std::string& source) const {
  const shm::SourceId id = simulation_.knows(source) ? simulation_.source_id(source) : shm::kNone;
  return simulation_.table().timeout(id);
}

ActivityWord Judge::word_of(const std::string& source, const Step& step, Nanoseconds start) const {
  const bool is_over = step.word == shm::kNeverActive || shm::is_deactivation(step.word);
  if (!with_timeouts_ || is_over || step.seen <= start) return step.word;
  return shm::arrival(step.time, timeout(source));
}

bool Judge::connects(const std::string& source, const std::string& port) const {
  const auto id = simulation_.find_port(port);
  return id && simulation_.knows(source) &&
         simulation_.table().find(simulation_.source_id(source), *id) != shm::kNone;
}

// Whether something that was written after `from` may have been seen.
void Judge::look(const Run& run, Read& read, Nanoseconds from, Nanoseconds to,
                 bool& has_later) const {
  const auto found = run.sources.find(*read.name);
  read.history = found == run.sources.end() ? nullptr : &found->second;
  if (read.history == nullptr) {
    has_later = read.is_unknown = true;
    return;
  }
  const Reached range = reached(*read.history, from, to);
  read.is_unknown = !is_known(*read.history, range, to);
  has_later = has_later || read.is_unknown || range.has_more;
  for (std::size_t i = range.surely; i < range.perhaps && !has_later; ++i) {
    has_later = read.history->steps[i].time > from;
  }
}

void Judge::judge_activity(const Run& run, Read& read, Nanoseconds from, Nanoseconds to,
                           const Reading& reading) const {
  read.may_be_active = read.may_be_inactive = read.is_unknown;
  if (read.is_unknown) return;
  const Reached range = reached(*read.history, from, to);
  read.may_be_active = read.may_be_inactive = range.has_more;
  for (std::size_t i = range.surely - 1; i < range.perhaps; ++i) {
    if (read.may_be_active && read.may_be_inactive) return;
    const ActivityWord word = word_of(*read.name, read.history->steps[i], run.start);
    read.may_be_active = read.may_be_active || shm::is_active(word, reading.first);
    read.may_be_inactive = read.may_be_inactive || !shm::is_active(word, reading.last);
  }
}

Permitted Judge::permitted(const Run& run, const Decision& decision, const std::string& port,
                           Connection& connection) {
  connection = Connection::none;
  const std::string& source = decision.context->source;
  const auto port_id = simulation_.find_port(port);
  if (!port_id || !simulation_.knows(source)) return {false, true, false};
  const shm::SourceId own = simulation_.source_id(source);
  const auto index = simulation_.table().find(own, *port_id);
  if (index == shm::kNone) return {false, true, false};
  connection = Connection::there;
  const shm::Rule rule = simulation_.table().rule(index);
  simulation_.set_activity(own, kActive);
  const Nanoseconds from = decision.arrival().time;
  const Nanoseconds to = decision.arrival().seen;
  std::vector<Read> reads;
  bool has_later = false;
  for (shm::Word i = 0; i < shm::BoundRule::reads_of(rule); ++i) {
    Read read;
    read.id = rule.reads[i] & ~shm::table::kExpectActive;
    if (read.id == own) continue;
    read.name = &simulation_.source_name(read.id);
    look(run, read, from, to, has_later);
    reads.push_back(read);
  }
  const Reading reading{from, has_later ? to : from};
  Permitted permitted;
  std::vector<Nanoseconds> moments{from};
  bool is_sure = true;
  for (Read& read : reads) {
    judge_activity(run, read, from, to, reading);
    if (!read.may_be_active || !read.may_be_inactive) continue;
    is_sure = false;
    permitted.rests_on_gap = permitted.rests_on_gap || read.is_unknown;
    if (read.history != nullptr) add_moments(*read.history, from, to, moments);
  }
  if (is_sure || moments.size() > kMostMoments) {
    evaluate(rule, reads, permitted);
  } else {
    for (const Nanoseconds moment : moments) {
      for (Read& read : reads) {
        bool ignored = false;
        look(run, read, moment, moment, ignored);
        judge_activity(run, read, moment, moment, reading);
      }
      evaluate(rule, reads, permitted);
    }
  }
  permitted.rests_on_gap = permitted.rests_on_gap && !permitted.is_sure();
  return permitted;
}

// Between these nothing changes.
void Judge::add_moments(const SourceHistory& history, Nanoseconds from, Nanoseconds to,
                        std::vector<Nanoseconds>& moments) {
  const Reached range = reached(history, from, to);
  for (std::size_t i = range.surely; i < range.perhaps; ++i) {
    const Step& step = history.steps[i];
    if (step.time > from) moments.push_back(step.time);
    if (step.seen < to) moments.push_back(step.seen + 1);
  }
  const Nanoseconds unknown = history.unknown_from;
  if (unknown > from && unknown <= to) moments.push_back(unknown);
}

// Every combination of what the sources may be, by the code that decides live.
void Judge::evaluate(const shm::Rule& rule, const std::vector<Read>& reads, Permitted& permitted) {
  std::vector<const Read*> uncertain;
  for (const Read& read : reads) {
    if (read.may_be_active && read.may_be_inactive) uncertain.push_back(&read);
    simulation_.set_activity(read.id, read.may_be_active ? kActive : shm::kNeverActive);
  }
  if (uncertain.size() > kMostUncertain) {
    permitted.wins = permitted.loses = true;
    return;
  }
  for (std::size_t all = 0; all < std::size_t{1} << uncertain.size(); ++all) {
    for (std::size_t i = 0; i < uncertain.size(); ++i) {
      simulation_.set_activity(uncertain[i]->id, (all >> i & 1) != 0 ? kActive : shm::kNeverActive);
    }
    (simulation_.is_delivered(rule) ? permitted.wins : permitted.loses) = true;
    if (permitted.wins && permitted.loses) return;
  }
}

}  // namespace arbiter::evidence
