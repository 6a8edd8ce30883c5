// Who wins at a port: the one answer for whoever asks for the port as a whole.
//
// A decision in publish() or take() is about one connection (decision.hpp). Who asks for a port, a
// component that waits, a status document, a tool or a trace, must not take such decisions one
// after the other: B takes over from A between the look at B and the look at A, and nobody seems to
// win though at every moment somebody did. So one picture is taken of all sources that the port
// heeds, and all of its rules are evaluated in that.
//
// A picture is taken in two passes, as that of a decision: the words are collected, the clock is
// read, and all are looked at again. If they stand, they stood together when the clock was read.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "shm/activity_pages.hpp"
#include "shm/decision.hpp"
#include "shm/decision_table.hpp"
#include "shm/limits.hpp"

namespace arbiter::shm {

// One source of a picture.
struct Sight {
  SourceId source;
  const Activity* activity;  // null: it has no page here
  SeenActivity seen;

  void look() noexcept {
    if (activity != nullptr) seen = SeenActivity::of(*activity);
  }
  [[nodiscard]] bool stands(Nanoseconds now) const noexcept {
    return activity == nullptr || seen.stands(SeenActivity::of(*activity), now);
  }
};

// Takes a picture of these sources. False: one of them has changed meanwhile, so that it mixes
// moments.
template <class Clock>
[[nodiscard]] bool take_picture(std::span<Sight> sights, Clock& clock) noexcept {
  for (Sight& each : sights) each.look();
  clock.read();
  return std::all_of(sights.begin(), sights.end(),
                     [&](const Sight& each) { return each.stands(clock.reading()); });
}

// Whether the rule holds where the connection's own source is active. `is_active(source)`.
template <class IsActive>
[[nodiscard]] bool holds_for_arrival(const Rule& rule, const IsActive& is_active) noexcept {
  const auto is = [&](Word read) {
    const SourceId source = read & ~table::kExpectActive;
    return source == rule.source || is_active(source);
  };
  switch (rule.kind) {
    case table::kAlways:
      return true;
    case table::kConjunction:
      for (Word i = 0; i < rule.reads.count; ++i) {
        const Word read = rule.reads[i];
        if (is(read) != ((read & table::kExpectActive) != 0)) return false;
      }
      return true;
    case table::kDiagram:
    case table::kInOrder:
      return walk_holds(rule.nodes, rule.root, rule.reads.count, kMaxWalk,
                        [&](Word position) { return is(rule.reads[position]); });
    default:
      return false;
  }
}

// Whether the rule holds, and its own source is active.
template <class IsActive>
[[nodiscard]] bool holds(const Rule& rule, const IsActive& is_active) noexcept {
  return is_active(rule.source) && holds_for_arrival(rule, is_active);
}

inline bool reads(const Rule& rule, SourceId source) noexcept {
  for (Word i = 0; i < rule.reads.count; ++i) {
    if ((rule.reads[i] & ~table::kExpectActive) == source) return true;
  }
  return false;
}

// The rule of the connection that the port selects: of one that is not arbitrated, and may select
// several, the first. Without a source: none.
template <class IsActive>
[[nodiscard]] Rule selected_at(const TableView& table, PortId port,
                               const IsActive& is_active) noexcept {
  const auto range = table.connections_to(port);
  for (auto index = range.first; index != range.first + range.count; ++index) {
    const Rule rule = table.rule(index);
    if (holds(rule, is_active)) return rule;
  }
  return {};
}

// Calls `f(source)` for each source that a port is connected to or reads, for some more than once.
template <class F>
void for_each_heeded(const TableView& table, PortId port, F f) noexcept {
  const auto range = table.connections_to(port);
  for (auto index = range.first; index != range.first + range.count; ++index) {
    f(table.rule(index).source);
  }
  const WordList read = table.sources_read(port);
  for (Word i = 0; i < read.count && i < kMaxSourcesPerPort; ++i) f(read[i]);
}

class SourceSet {
 public:
  void clear() noexcept { words_.fill(0); }
  // True: it was not in it. What is no source's number is in no set.
  bool insert(SourceId source) noexcept {
    if (source >= kMaxSources) return false;
    std::uint64_t& word = words_[source / 64];
    const std::uint64_t bit = std::uint64_t{1} << (source % 64);
    const bool is_new = (word & bit) == 0;
    word |= bit;
    return is_new;
  }
  [[nodiscard]] bool contains(SourceId source) const noexcept {
    return source < kMaxSources && (words_[source / 64] >> (source % 64) & 1) != 0;
  }

 private:
  std::array<std::uint64_t, kMaxSources / 64> words_{};
};

// Who commands a port. `selected`: the connection whose rule holds. `commander`: the same if
// anything of it can come; where there is none, the port is idle. Without a source: none.
struct Command {
  Rule selected;
  Rule commander;
};

// The picture of all sources that one port heeds. It allocates nothing.
// Thread safety: none; each has an owner.
class PortPicture {
 public:
  // Of which sources it is; again for another table, and where pages have come.
  void bind(const TableView& table, PortId port, const ActivityPages& pages) noexcept {
    table_ = table;
    port_ = port;
    count_ = 0;
    are_all_seen_ = true;
    seen_.clear();
    active_.clear();
    SourceSet heeded;
    for_each_heeded(table, port, [&](SourceId source) {
      if (!heeded.insert(source)) return;
      const Activity* const activity = pages.find(source);
      // A whole table heeds no more sources than there is room for.
      if (activity == nullptr || count_ == sights_.size()) {
        are_all_seen_ = false;
        return;
      }
      seen_.insert(source);
      sights_[count_++] = {source, activity, {}};
    });
  }

  // False, where the sources change faster than they can be looked at: then nobody is active in it.
  // Wait-free: at most `tries` times two passes.
  template <class Clock>
  [[nodiscard]] bool take(Clock& clock, int tries = kMaxPictures) noexcept {
    const std::span<Sight> sights(sights_.data(), count_);
    active_.clear();
    for (int i = 0; i < tries; ++i) {
      if (!take_picture(sights, clock)) continue;
      for (const Sight& each : sights) {
        if (is_active(each.seen.word, clock.reading())) active_.insert(each.source);
      }
      return true;
    }
    return false;
  }

  // For an arrival, which makes the connection's own source active.
  [[nodiscard]] Verdict decide(const Rule& rule) const noexcept {
    if (is_blind(rule, true)) return Verdict::kBlind;
    const auto is = [this](SourceId source) { return active_.contains(source); };
    return holds_for_arrival(rule, is) ? Verdict::kWins : Verdict::kLoses;
  }
  // With the connection's own activity as it is.
  [[nodiscard]] Verdict decide_with_own(const Rule& rule) const noexcept {
    if (is_blind(rule, false)) return Verdict::kBlind;
    const auto is = [this](SourceId source) { return active_.contains(source); };
    return holds(rule, is) ? Verdict::kWins : Verdict::kLoses;
  }

  // Where an arbiter has selected, nobody takes the place of one that cannot deliver.
  // `can_deliver(rule)` is asked of selected connections alone.
  template <class CanDeliver>
  [[nodiscard]] Command command(const CanDeliver& can_deliver) const {
    Command command;
    const auto range = table_.connections_to(port_);
    for (auto index = range.first; index != range.first + range.count; ++index) {
      const Rule rule = table_.rule(index);
      if (decide_with_own(rule) != Verdict::kWins) continue;
      if (command.selected.source == kNone) command.selected = rule;
      const bool is_commander = can_deliver(rule);
      if (is_commander) command.commander = rule;
      if (is_commander || table_.is_arbitrated(port_)) break;
    }
    return command;
  }
  // Whether the port selects a connection at all, or might by a source that is not seen here.
  struct Selection {
    Rule rule;  // without a source: none
    bool is_sure = true;
  };
  [[nodiscard]] Selection selection() const noexcept {
    Selection selection;
    const auto range = table_.connections_to(port_);
    for (auto index = range.first; index != range.first + range.count; ++index) {
      const Rule rule = table_.rule(index);
      const Verdict verdict = decide_with_own(rule);
      if (verdict == Verdict::kWins) return {rule, true};
      selection.is_sure = selection.is_sure && verdict == Verdict::kLoses;
    }
    return selection;
  }

  // When time alone can change what the picture says of a connection: at the first end among the
  // activities that its rule reads, and its own. As they were seen: who was active then, and has
  // been deactivated once it had ended, rings for nobody.
  [[nodiscard]] Nanoseconds first_end(const Rule& rule) const noexcept {
    Nanoseconds first = kForever;
    for (const Sight& each : std::span(sights_.data(), count_)) {
      if (!active_.contains(each.source) || !is_finite(each.seen.word)) continue;
      if (each.seen.word >= first) continue;
      if (rule.source == each.source || reads(rule, each.source)) first = each.seen.word;
    }
    return first;
  }

 private:
  // As BoundRule: a rule that reads what is not seen is not evaluated.
  [[nodiscard]] bool is_blind(const Rule& rule, bool is_arrival) const noexcept {
    if (are_all_seen_ || rule.kind == table::kNever) return false;
    if (!is_arrival && !seen_.contains(rule.source)) return true;
    for (Word i = 0; i < BoundRule::reads_of(rule); ++i) {
      const SourceId read = rule.reads[i] & ~table::kExpectActive;
      if (read != rule.source && !seen_.contains(read)) return true;
    }
    return false;
  }

  TableView table_;
  PortId port_ = kNone;
  std::array<Sight, kMaxSourcesPerPort> sights_;  // the first count_ of them
  std::size_t count_ = 0;
  bool are_all_seen_ = true;
  SourceSet seen_;
  SourceSet active_;
};

}  // namespace arbiter::shm
