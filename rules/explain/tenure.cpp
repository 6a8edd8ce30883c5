#include "rules/explain/tenure.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <set>

#include "shm/port_picture.hpp"

namespace arbiter::rules {
namespace {

constexpr shm::Word kExpectActive = shm::table::kExpectActive;

Activation activation(bool active) { return active ? Activation::kActive : Activation::kInactive; }

Activation both(Activation left, Activation right) {
  if (left == Activation::kInactive || right == Activation::kInactive) return Activation::kInactive;
  return left == Activation::kActive && right == Activation::kActive ? Activation::kActive
                                                                     : Activation::kUnknown;
}

// Which ends of a diagram can be reached, if both ways are gone where a source is unknown. Exact
// where no way meets a source twice; of rules in order some may, which leaves more unknown than is.
Activation walk(const shm::Rule& rule, const std::vector<Activation>& reads) {
  namespace table = shm::table;
  const shm::Word count = rule.nodes.count / table::kNodeWords;
  std::vector<bool> reached(count, false);
  const bool begins = rule.root < count;
  if (begins) reached[rule.root] = true;
  bool can_hold = false;
  bool can_fail = !begins;
  const auto go = [&](shm::Word from, shm::Word to) {
    if (to == table::kTrue) {
      can_hold = true;
    } else if (to > from && to < count) {  // successors lie behind their node
      reached[to] = true;
    } else {
      can_fail = true;
    }
  };
  for (shm::Word node = 0; node < count; ++node) {
    if (!reached[node]) continue;
    const shm::Word base = node * table::kNodeWords;
    const shm::Word position = rule.nodes[base + table::kNodePosition];
    if (position >= reads.size()) {
      can_fail = true;
      continue;
    }
    if (reads[position] != Activation::kInactive) go(node, rule.nodes[base + table::kNodeHigh]);
    if (reads[position] != Activation::kActive) go(node, rule.nodes[base + table::kNodeLow]);
  }
  if (can_hold && can_fail) return Activation::kUnknown;
  return activation(can_hold);
}

// The past of one source, latest first: what it was from each of these times until the one before.
struct Past {
  struct Span {
    shm::Nanoseconds since;
    Activation activation;
  };
  std::vector<Span> spans;
  Activation before = Activation::kUnknown;  // further back

  // `arrived_by`, `began`: as in Moment.
  static Past of(shm::ActivityWord word, shm::Nanoseconds timeout,
                 std::optional<shm::Nanoseconds> arrived_by, std::optional<shm::Nanoseconds> began,
                 shm::Nanoseconds now) {
    if (word == shm::kNeverActive) return {{}, Activation::kInactive};
    const shm::Nanoseconds end = word & ~shm::kDeactivatedFlag;
    if (began) {
      Past past{{{*began, Activation::kActive}, {*began - 1, Activation::kInactive}}};
      if (!shm::is_active(word, now)) {
        past.spans.insert(past.spans.begin(), {end, Activation::kInactive});
      }
      return past;
    }
    if (shm::is_deactivation(word)) return {{{end, Activation::kInactive}}};
    // T may have been another at the arrival. But it arrived before now, and was active after it.
    const shm::Nanoseconds arrived = std::min(arrived_by.value_or(shm::arrival_of(word, timeout)),
                                              std::min<shm::Nanoseconds>(now, word - 1));
    if (shm::is_active(word, now)) return {{{arrived, Activation::kActive}}};
    return {{{word, Activation::kInactive}, {arrived, Activation::kActive}}};
  }

  // Just before a time.
  [[nodiscard]] Activation just_before(shm::Nanoseconds time) const {
    for (const Span& span : spans) {
      if (span.since < time) return span.activation;
    }
    return before;
  }
};

// Whether that source, or nobody where it is kNone, is selected.
Activation is_selected(const shm::TableView& table, shm::PortId port, shm::SourceId winner,
                       const std::function<Activation(shm::SourceId)>& activation_of) {
  Activation nobody = Activation::kActive;
  const auto range = table.connections_to(port);
  for (auto index = range.first; index != range.first + range.count; ++index) {
    const shm::Rule rule = table.rule(index);
    if (winner != shm::kNone && rule.source != winner) continue;
    const Activation holds = evaluate(rule, activation_of);
    if (rule.source == winner) return holds;
    if (holds == Activation::kActive) return Activation::kInactive;
    if (holds == Activation::kUnknown) nobody = Activation::kUnknown;
  }
  return winner == shm::kNone ? nobody : Activation::kInactive;
}

}  // namespace

Activation evaluate(const shm::Rule& rule,
                    const std::function<Activation(shm::SourceId)>& activation_of) {
  if (rule.kind == shm::table::kNever) return Activation::kInactive;
  const Activation own = activation_of(rule.source);
  if (rule.kind == shm::table::kAlways || own == Activation::kInactive) return own;
  if (rule.kind == shm::table::kDiagram || rule.kind == shm::table::kInOrder) {
    std::vector<Activation> reads;
    for (shm::Word i = 0; i < rule.reads.count; ++i) {
      const bool is_own = rule.reads[i] == rule.source;
      reads.push_back(is_own ? Activation::kActive : activation_of(rule.reads[i]));
    }
    return both(own, walk(rule, reads));
  }
  Activation result = own;
  for (shm::Word i = 0; i < rule.reads.count; ++i) {
    const Activation read = activation_of(rule.reads[i] & ~kExpectActive);
    const bool wanted = (rule.reads[i] & kExpectActive) != 0;
    if (read == Activation::kUnknown) {
      result = both(result, read);
    } else if ((read == Activation::kActive) != wanted) {
      return Activation::kInactive;
    }
  }
  return result;
}

std::vector<shm::SourceId> sources_heeded(const shm::TableView& table, shm::PortId port) {
  std::set<shm::SourceId> sources;
  shm::for_each_heeded(table, port, [&](shm::SourceId source) { sources.insert(source); });
  return {sources.begin(), sources.end()};
}

Tenure tenure_of(const shm::TableView& table, shm::PortId port, shm::SourceId winner,
                 const Moment& moment) {
  std::map<shm::SourceId, Past> pasts;
  std::map<shm::Nanoseconds, std::vector<shm::SourceId>, std::greater<>> changes;
  for (const shm::SourceId source : sources_heeded(table, port)) {
    const auto arrived_by = moment.arrived_by ? moment.arrived_by(source) : std::nullopt;
    const auto began = moment.began ? moment.began(source) : std::nullopt;
    const Past past =
        Past::of(moment.word(source), table.timeout(source), arrived_by, began, moment.now);
    for (const auto& span : past.spans) changes[span.since].push_back(source);
    pasts.emplace(source, past);
  }
  Tenure tenure;
  tenure.at_least = moment.model_since;
  bool is_sure = true;
  for (const auto& change : changes) {
    const shm::Nanoseconds time = change.first;
    if (time <= moment.model_since) break;
    const auto before = is_selected(table, port, winner, [&](shm::SourceId source) {
      return pasts.at(source).just_before(time);
    });
    if (before == Activation::kActive) continue;
    if (is_sure) tenure.at_least = time;
    is_sure = false;
    if (before == Activation::kUnknown) continue;
    tenure.not_before = time;
    tenure.changed = change.second;
    break;
  }
  return tenure;
}

}  // namespace arbiter::rules
