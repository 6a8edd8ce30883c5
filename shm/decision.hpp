// The decision of an arbiter (paper, section III.A): does this rule hold now?
//
// The same code decides in publish(), in take() and in `arbiter simulate`.
//
// One consistent picture. A rule that reads several sources must see them as they were together at
// some instant. Reading one after the other is not enough: with the rule A and not B and not C, let
// C arrive and then B be deactivated between our reading of C and our reading of B; each was seen
// inactive, yet never were both. So the words are collected, then read again, and count only if
// none has changed: values never repeat (activity.hpp), hence at the end of the first pass all of
// them stood as collected. A reading that denies a conjunction needs no second look: at the instant
// of that one load the conjunction was false.
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
  void attach(SourceId id, const Atomic<ActivityWord>* word) noexcept {
    words_[id].store(word, std::memory_order_release);
  }
  [[nodiscard]] const Atomic<ActivityWord>* find(SourceId id) const noexcept {
    return id < kMaxSources ? words_[id].load(std::memory_order_acquire) : nullptr;
  }

 private:
  std::array<Atomic<const Atomic<ActivityWord>*>, kMaxSources> words_{};
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
    const Atomic<ActivityWord>* own = pages_.find(rule.source);
    if (own == nullptr) return rule.source == kNone ? Verdict::kLoses : Verdict::kBlind;
    ActivityWord own_seen = kNeverActive;
    return repeat([&] { return with_own(rule, *own, own_seen); });
  }

 private:
  enum class Pass : std::uint8_t { kNo, kYes, kAgain, kBlind };

  template <class Attempt>
  Verdict repeat(Attempt attempt) noexcept {
    known_ = 0;
    for (int i = 0; i < kMaxPictures; ++i) {
      switch (attempt()) {
        case Pass::kNo:
          return Verdict::kLoses;
        case Pass::kYes:
          return Verdict::kWins;
        case Pass::kBlind:
          return Verdict::kBlind;
        case Pass::kAgain:
          break;
      }
    }
    return Verdict::kUnsettled;
  }

  // Whether `word` can be judged only by a reading of the clock that is taken after it was seen.
  // `seen_before_reading` says that it was; then no T, not even one that a reload has changed
  // since, makes it look newer than the reading.
  [[nodiscard]] bool needs_clock(SourceId source, ActivityWord word,
                                 bool seen_before_reading) const noexcept {
    if (!is_active(word, clock_.reading()) || !is_finite(word)) return false;
    if (!clock_.is_fresh()) return true;
    return !seen_before_reading && is_newer_than(word, table_.timeout(source), clock_.reading());
  }

  Pass with_own(const Rule& rule, const Atomic<ActivityWord>& own,
                ActivityWord& own_seen) noexcept {
    const ActivityWord word = own.load(std::memory_order_acquire);  // SYNC POINT: activity-picture
    const bool seen = word == own_seen;
    own_seen = word;
    if (needs_clock(rule.source, word, seen)) {
      clock_.read();
      known_ = 0;
      return Pass::kAgain;
    }
    if (!is_active(word, clock_.reading())) return Pass::kNo;
    const Pass rest = once(rule);
    if (rest != Pass::kYes || rule.reads.count == 0) return rest;
    return own.load(std::memory_order_relaxed) == word ? rest : Pass::kAgain;
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

  // The first pass over one word.
  Pass collect(const Rule& rule, Word i) noexcept {
    const SourceId source = rule.reads[i] & ~table::kExpectActive;
    const Atomic<ActivityWord>* word = pages_.find(source);
    if (word == nullptr) return Pass::kBlind;
    // SYNC POINT: activity-picture. Acquire, so that the second pass reads after the first.
    const ActivityWord value = word->load(std::memory_order_acquire);
    const bool seen = i < known_ && collected_[i] == value;
    collected_[i] = value;
    if (needs_clock(source, value, seen)) return read_clock(rule, i);
    return is_active(value, clock_.reading()) ? Pass::kYes : Pass::kNo;
  }

  // Sees all words before it reads the clock, so that no second reading is needed for the others.
  Pass read_clock(const Rule& rule, Word from) noexcept {
    for (Word i = from + 1; i < rule.reads.count; ++i) {
      const Atomic<ActivityWord>* word = pages_.find(rule.reads[i] & ~table::kExpectActive);
      if (word == nullptr) return Pass::kBlind;
      collected_[i] = word->load(std::memory_order_acquire);
    }
    known_ = rule.reads.count;
    clock_.read();
    return Pass::kAgain;
  }

  Pass conjunction(const Rule& rule) noexcept {
    for (Word i = 0; i < rule.reads.count; ++i) {
      const Pass pass = collect(rule, i);
      if (pass == Pass::kAgain || pass == Pass::kBlind) return pass;
      if ((pass == Pass::kYes) != ((rule.reads[i] & table::kExpectActive) != 0)) return Pass::kNo;
    }
    return unchanged(rule) ? Pass::kYes : Pass::kAgain;
  }

  Pass diagram(const Rule& rule) noexcept {
    std::array<std::uint64_t, kMaxSourcesPerPort / 64> active{};
    for (Word i = 0; i < rule.reads.count; ++i) {
      const Pass pass = collect(rule, i);
      if (pass == Pass::kAgain || pass == Pass::kBlind) return pass;
      if (pass == Pass::kYes) active[i / 64] |= std::uint64_t{1} << (i % 64);
    }
    if (!unchanged(rule)) return Pass::kAgain;
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

  // The second pass. One word alone is a picture already.
  [[nodiscard]] bool unchanged(const Rule& rule) const noexcept {
    if (rule.reads.count < 2) return true;
    for (Word i = 0; i < rule.reads.count; ++i) {
      const Atomic<ActivityWord>* word = pages_.find(rule.reads[i] & ~table::kExpectActive);
      if (word == nullptr) return false;  // the table was overwritten meanwhile
      if (word->load(std::memory_order_relaxed) != collected_[i]) return false;
    }
    return true;
  }

  const TableView& table_;
  const ActivityPages& pages_;
  Clock& clock_;
  Word known_ = 0;  // how many words of collected_ were seen before the clock was last read
  std::array<ActivityWord, kMaxSourcesPerPort> collected_;  // of the last pass; written before read
};

}  // namespace arbiter::shm
