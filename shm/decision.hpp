// The decision of an arbiter (paper, section III.A): does this rule hold now?
//
// The same code decides in publish(), in take() and in `arbiter simulate`.
//
// One consistent picture. A rule that reads several sources must see them as they were together at
// some instant. Reading one after the other is not enough: with the rule A and not B and not C, let
// C arrive and then B be deactivated between our reading of C and our reading of B; each was seen
// inactive, yet never were both. So the words are collected, then read again, and count only if
// each still says the same: its value is unchanged, and values never repeat (activity.hpp), or an
// active source was renewed in time, without a break. Hence at the end of the first pass all of
// them stood as collected, and a source that publishes flat out unsettles nobody. A reading that
// denies a conjunction needs no second look: at the instant of that one load the conjunction was
// false.
//
// Time. `now` is a reading of the clock that the caller took before. Where a word was written after
// that reading, an activity that ended in between would be combined with one that began later; so
// the clock is read again and the picture taken anew. A caller may pass an old reading
// (`Clock::is_fresh` false): what ended before it is over whatever the time is, what never ends
// holds, and only a word between the two makes us read the clock. This saves most takes a clock
// read and is exact.
#pragma once

#include <array>
#include <cstdint>

#include "shm/activity.hpp"
#include "shm/atomic.hpp"
#include "shm/decision_table.hpp"
#include "shm/limits.hpp"

namespace arbiter::shm {

enum class Verdict : std::uint8_t {
  kLoses,
  kWins,
  kBlind,      // a source that the rule reads has no page here yet: deliver nothing
  kUnsettled,  // sources changed faster than a picture could be taken: deliver nothing
};

// Where a process finds the activity of each source.
// Thread safety: one thread attaches, any thread reads. SYNC POINT: page-attached. The release in
// attach() pairs with the acquire in find(): who finds a page finds it mapped.
class ActivityPages {
 public:
  void attach(SourceId id, const Activity* activity) noexcept {
    activities_[id].store(activity, std::memory_order_release);
  }
  [[nodiscard]] const Activity* find(SourceId id) const noexcept {
    return id < kMaxSources ? activities_[id].load(std::memory_order_acquire) : nullptr;
  }

 private:
  std::array<Atomic<const Activity*>, kMaxSources> activities_{};
};

// One look at a source.
struct SeenActivity {
  ActivityWord word;
  std::uint64_t breaks;        // read before the word: none that comes later is among them
  std::uint64_t breaks_until;  // read after it: all that came before the word are among them

  // SYNC POINT: activity-picture. Acquire, so that a second look comes after the first.
  static SeenActivity of(const Activity& activity) noexcept {
    const std::uint64_t breaks = activity.breaks.load(std::memory_order_acquire);
    const ActivityWord word = activity.word.load(std::memory_order_acquire);
    return {word, breaks, activity.breaks.load(std::memory_order_relaxed)};
  }

  // Whether the source has stood as it was seen, at `now`, until a later look: nothing was written,
  // or it was active and has been renewed since without a gap.
  [[nodiscard]] bool stands(const SeenActivity& later, Nanoseconds timeout,
                            Nanoseconds now) const noexcept {
    if (later.word == word) return true;
    if (!is_active(word, now) || is_deactivation(later.word) || later.breaks_until != breaks)
      return false;
    return !is_finite(word) || arrival_of(later.word, timeout) < word;
  }
};

// How often a picture is taken anew before the decision is given up as unsettled. A second round
// needs a source that changed within the ~20 ns of the first; it is bounded so that no publisher
// can hold up a receiver.
inline constexpr int kMaxPictures = 64;

// Clock: Nanoseconds reading() const; bool is_fresh() const; void read().
template <class Clock>
class Decider {
 public:
  Decider(const TableView& table, const ActivityPages& pages, Clock& clock) noexcept
      : table_(table), pages_(pages), clock_(clock) {}

  // Whether `rule` selects its connection, whose own activity is taken as given.
  // Wait-free: at most kMaxPictures passes over at most kMaxSourcesPerPort words.
  [[nodiscard]] Verdict decide(const Rule& rule) noexcept {
    return repeat([&] { return once(rule); });
  }

  // The same with the connection's own activity read too: is it the winner?
  [[nodiscard]] Verdict decide_with_own(const Rule& rule) noexcept {
    if (rule.kind == table::kNever) return Verdict::kLoses;
    return repeat([&] {
      const Pass own = collect(rule.source, kOwn);
      if (own == Pass::kAgain) return read_clock({}, 0);
      if (own != Pass::kYes) return own;
      const Pass rest = once(rule);
      if (rest != Pass::kYes || rule.reads.count == 0) return rest;
      return stands(rule.source, kOwn) ? rest : Pass::kAgain;
    });
  }

 private:
  enum class Pass : std::uint8_t { kNo, kYes, kAgain, kBlind };

  static constexpr Word kOwn = kMaxSourcesPerPort;

  template <class Attempt>
  Verdict repeat(Attempt attempt) noexcept {
    collected_ = 0;
    settled_ = 0;
    own_settled_ = false;
    for (int i = 0; i < kMaxPictures; ++i) {
      switch (attempt()) {
        case Pass::kNo:
          return Verdict::kLoses;
        case Pass::kYes:
          return Verdict::kWins;
        case Pass::kBlind:
          return Verdict::kBlind;
        case Pass::kAgain:
          settled_ = collected_;
          own_settled_ = true;
          break;
      }
    }
    return Verdict::kUnsettled;
  }

  Pass once(const Rule& rule) noexcept {
    switch (rule.kind) {
      case table::kAlways:
        return Pass::kYes;
      case table::kConjunction:
        return conjunction(rule);
      case table::kDiagram:
        return diagram(rule);
      default:
        return Pass::kNo;
    }
  }

  // The first pass over one source: is it active? kAgain: only a reading from now on can tell.
  Pass collect(SourceId source, Word i) noexcept {
    const Activity* activity = pages_.find(source);
    if (activity == nullptr) return Pass::kBlind;
    SeenActivity& seen = seen_[i];
    if (i != kOwn && i == collected_) ++collected_;
    // What an earlier pass has seen was held against the clock then; no T, not even one that a
    // reload has changed since, makes it look newer than the reading now.
    const bool settled = i == kOwn ? own_settled_ : i < settled_;
    const SeenActivity look = SeenActivity::of(*activity);
    if (!settled || !seen.stands(look, table_.timeout(source), clock_.reading())) {
      seen = look;
      if (needs_clock(source, look.word)) return Pass::kAgain;
    }
    return is_active(seen.word, clock_.reading()) ? Pass::kYes : Pass::kNo;
  }

  // Looks at the rest too before it reads the clock: then one reading settles them all.
  Pass read_clock(const Rule& rule, Word next) noexcept {
    for (; next < rule.reads.count; ++next) {
      if (collect(source_of(rule, next), next) == Pass::kBlind) return Pass::kBlind;
    }
    clock_.read();
    return Pass::kAgain;
  }

  // Whether a word can be judged only by a reading of the clock that is taken after it was seen.
  [[nodiscard]] bool needs_clock(SourceId source, ActivityWord word) const noexcept {
    const bool may_end = is_finite(word) && is_active(word, clock_.reading());
    if (!clock_.is_fresh()) return may_end;
    if (is_finite(word) && !may_end) return false;
    const Nanoseconds timeout = may_end ? table_.timeout(source) : kForever;
    return is_newer_than(word, timeout, clock_.reading());
  }

  // The second pass over one source.
  [[nodiscard]] bool stands(SourceId source, Word i) const noexcept {
    const Activity* activity = pages_.find(source);
    if (activity == nullptr) return false;  // the table was overwritten meanwhile
    return seen_[i].stands(SeenActivity::of(*activity), table_.timeout(source), clock_.reading());
  }

  // One word alone is a picture already.
  [[nodiscard]] bool all_stand(const Rule& rule) const noexcept {
    if (rule.reads.count < 2) return true;
    for (Word i = 0; i < rule.reads.count; ++i) {
      if (!stands(source_of(rule, i), i)) return false;
    }
    return true;
  }

  static SourceId source_of(const Rule& rule, Word i) noexcept {
    return rule.reads[i] & ~table::kExpectActive;
  }

  Pass conjunction(const Rule& rule) noexcept {
    for (Word i = 0; i < rule.reads.count; ++i) {
      const Pass pass = collect(source_of(rule, i), i);
      if (pass == Pass::kAgain) return read_clock(rule, i + 1);
      if (pass == Pass::kBlind) return pass;
      if ((pass == Pass::kYes) != ((rule.reads[i] & table::kExpectActive) != 0)) return Pass::kNo;
    }
    return all_stand(rule) ? Pass::kYes : Pass::kAgain;
  }

  Pass diagram(const Rule& rule) noexcept {
    std::array<std::uint64_t, kMaxSourcesPerPort / 64> active{};
    for (Word i = 0; i < rule.reads.count; ++i) {
      const Pass pass = collect(source_of(rule, i), i);
      if (pass == Pass::kAgain) return read_clock(rule, i + 1);
      if (pass == Pass::kBlind) return pass;
      if (pass == Pass::kYes) active[i / 64] |= std::uint64_t{1} << (i % 64);
    }
    if (!all_stand(rule)) return Pass::kAgain;
    // Each step goes to a node further on, so a whole table ends the walk; a torn one is cut short.
    Word node = 0;
    for (Word steps = 0; steps <= rule.reads.count; ++steps) {
      if (node >= rule.nodes.count / table::kNodeWords) return Pass::kNo;
      const Word base = node * table::kNodeWords;
      const Word position = rule.nodes[base + table::kNodePosition];
      if (position >= rule.reads.count) return Pass::kNo;
      const bool high = (active[position / 64] >> (position % 64) & 1) != 0;
      const Word next = rule.nodes[base + (high ? table::kNodeHigh : table::kNodeLow)];
      if (next == table::kTrue) return Pass::kYes;
      if (next == table::kFalse) return Pass::kNo;
      node = next;
    }
    return Pass::kNo;
  }

  const TableView& table_;
  const ActivityPages& pages_;
  Clock& clock_;
  Word collected_ = 0;        // how many of seen_ are of this decision
  Word settled_ = 0;          // how many of them are of an earlier pass
  bool own_settled_ = false;  // the same of our own
  std::array<SeenActivity, kMaxSourcesPerPort + 1> seen_;  // the last is our own
};

}  // namespace arbiter::shm
