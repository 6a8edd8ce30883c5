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
// them stood as collected, and a source that publishes flat out unsettles nobody. Where one of them
// denies a conjunction, a second look at that one is enough.
//
// Time. `now` is a reading of the clock that the caller took before. Where a word was written after
// that reading, an activity that ended in between would be combined with one that began later; so
// the clock is read again once all were seen, and they are looked at again. T tells when a word was
// written, but for an arrival under a model before, which may have had another. Such an arrival was
// before the model in force; so a reading that may be older than that is passed as an old one.
//
// A caller may pass an old reading (`Clock::is_fresh` false): what ended before it is over whatever
// the time is, what never ends holds, and only a word between the two makes us read the clock. This
// saves most takes a clock read and is exact.
#pragma once

#include <array>
#include <cstdint>

#include "shm/activity.hpp"
#include "shm/activity_pages.hpp"
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
  // or it was active and has been renewed since without a gap. No T is asked: the words may have
  // come from models of which each had its own.
  [[nodiscard]] bool stands(const SeenActivity& later, Nanoseconds now) const noexcept {
    if (later.word == word) return true;
    return is_active(word, now) && is_active(later.word, now) && later.breaks_until == breaks;
  }
};

// How often a picture is taken anew before the decision is given up as unsettled. A second round
// needs a source that changed within the ~20 ns of the first; it is bounded so that no publisher
// can hold up a receiver.
inline constexpr int kMaxPictures = 64;

// The most nodes of one walk. A diagram tests each source once; rules in order each do.
inline constexpr Word kMaxWalk = (kMaxSourcesPerPort + 1) * (kMaxSourcesPerPort + 1);

// Where a walk through a diagram's nodes ends. `is_active(position)`: whether the source at that
// place of the rule's `reads` reads is. Each step goes to a node further on, so a whole table ends
// the walk within `max_steps`; a torn one is cut short.
template <class IsActive>
[[nodiscard]] bool walk_holds(const WordList& nodes, Word root, Word reads, Word max_steps,
                              const IsActive& is_active) noexcept {
  Word node = root;
  for (Word steps = 0; steps <= max_steps; ++steps) {
    if (node >= nodes.count / table::kNodeWords) return false;
    const Word base = node * table::kNodeWords;
    const Word position = nodes[base + table::kNodePosition];
    if (position >= reads) return false;
    const Word next = nodes[base + (is_active(position) ? table::kNodeHigh : table::kNodeLow)];
    if (next == table::kTrue) return true;
    if (next == table::kFalse) return false;
    node = next;
  }
  return false;
}

// In place of a connection's own source, where its rule is to take that as active.
inline const Activity always_active{{kForeverFlag}, {0}, {0}};

// A source that a rule reads, and how it was last seen.
struct Read {
  const Activity* activity;  // null: it has no page here
  ActivityWord word;
  std::uint64_t breaks;
  SourceId source;
  bool expect_active;  // in a conjunction
};

// A rule, bound to the activities that it reads, and its last verdict.
//
// Where nothing has changed since the last decision, looking once is enough: each word stood from
// then until now, so all stood together when this decision began. Time can change the verdict too:
// not before the first of the activities ends. And a conjunction that was denied is denied still
// while the one that denied it has not changed. Hence most decisions cost a load for each source
// that is read, most of those of losers a load in all, and only what has changed is looked at
// twice.
//
// Clock: Nanoseconds reading() const; bool is_fresh() const; void read(). Its readings never go
// back from one decision to the next.
// Thread safety: none; it belongs to its port's thread.
class BoundRule {
 public:
  BoundRule() = default;

  // How much memory bind() is to be given. At most kMaxSourcesPerPort.
  static Word reads_of(const Rule& rule) noexcept {
    const bool reads_others =
        rule.kind == table::kConjunction || rule.kind == table::kDiagram || is_in_order(rule);
    return reads_others ? rule.reads.count : 0;
  }

  // `reads`: memory for reads_of() of them, and for one more with the connection's own activity,
  // which is otherwise taken as given.
  void bind(const Rule& rule, const ActivityPages& pages, Read* reads, bool with_own) noexcept {
    kind_ = rule.kind;
    nodes_ = rule.nodes;
    reads_ = reads;
    count_ = 0;
    is_blind_ = false;
    was_collected_ = false;
    own_ = with_own ? 1 : 0;
    if (with_own && kind_ != table::kNever) add(rule.source, true, pages);
    for (Word i = 0; i < reads_of(rule); ++i) {
      const Word read = rule.reads[i];
      add(read & ~table::kExpectActive, (read & table::kExpectActive) != 0, pages);
    }
    if (is_in_order(rule)) take_own_as_active(rule.source);
    walks_ = kind_ == table::kDiagram || is_in_order(rule);
    root_ = rule.root;
    max_walk_ = is_in_order(rule) ? kMaxWalk : count_;
    // Those that deny a rule each by itself.
    literals_ = kind_ == table::kConjunction ? count_ : own_;
    if (count_ == 0) {
      verdict_ = kind_ == table::kAlways || kind_ == table::kConjunction ? Verdict::kWins
                                                                         : Verdict::kLoses;
    }
  }

  // Whether the rule selects its connection. `table` is the one that the rule is of.
  // Wait-free: at most kMaxPictures times two passes over at most kMaxSourcesPerPort words.
  template <class Clock>
  [[nodiscard]] Verdict decide(const TableView& table, Clock& clock) noexcept {
    if (count_ == 0) return verdict_;
    if (is_blind_) return Verdict::kBlind;
    for (int i = 0; i < kMaxPictures; ++i) {
      if (was_collected_ && stands(clock)) return verdict_;
      collect(table, clock);
    }
    return Verdict::kUnsettled;
  }

  // When time alone can change the last verdict, or a little earlier: at the first end among the
  // activities that it was found by.
  [[nodiscard]] Nanoseconds until() const noexcept { return count_ == 0 ? kForever : until_; }

 private:
  static constexpr Word kNobody = UINT32_MAX;

  static bool is_in_order(const Rule& rule) noexcept { return rule.kind == table::kInOrder; }

  // The rules before it may read the connection's own source, for which it has no page then.
  void take_own_as_active(SourceId own) noexcept {
    is_blind_ = false;
    for (Word i = 0; i < count_; ++i) {
      if (i >= own_ && reads_[i].source == own) reads_[i].activity = &always_active;
      is_blind_ = is_blind_ || reads_[i].activity == nullptr;
    }
  }

  void add(SourceId source, bool expect_active, const ActivityPages& pages) noexcept {
    Read& read = reads_[count_++];
    read.activity = pages.find(source);
    read.source = source;
    read.expect_active = expect_active;
    is_blind_ = is_blind_ || read.activity == nullptr;
  }

  // The first pass. What it collects may be of several moments; they stood together if the next
  // look finds the same. Where a word needs a reading of the clock that is taken after it was seen,
  // one reading does for all.
  template <class Clock>
  void collect(const TableView& table, Clock& clock) noexcept {
    bool needs_reading = false;
    for (Word i = 0; i < count_; ++i) {
      Read& read = reads_[i];
      const SeenActivity seen = SeenActivity::of(*read.activity);
      read.word = seen.word;
      read.breaks = seen.breaks;
      needs_reading = needs_reading || needs_clock(table, read, clock);
    }
    if (needs_reading) clock.read();
    evaluate(clock.reading());
    was_collected_ = true;
  }

  // Whether a word can be judged only by a reading of the clock that is taken after it was seen.
  template <class Clock>
  static bool needs_clock(const TableView& table, const Read& read, const Clock& clock) noexcept {
    const bool may_end = is_finite(read.word) && is_active(read.word, clock.reading());
    if (!clock.is_fresh()) return may_end;
    if (is_finite(read.word) && !may_end) return false;
    const Nanoseconds timeout = may_end ? table.timeout(read.source) : kForever;
    return is_newer_than(read.word, timeout, clock.reading());
  }

  // The second pass, and the only one where nothing has changed: whether all sources have stood as
  // they were collected until now, and the verdict holds at this time. The loads are relaxed: the
  // acquires of the first pass put them behind it, and it does not matter in which order they come.
  // Where something has ended by a clock that is read after them, they must be looked at again.
  template <class Clock>
  bool stands(Clock& clock) noexcept {
    if (denied_by_ != kNobody && still_denies(reads_[denied_by_], clock)) return true;
    ActivityWord differences = 0;
    for (Word i = 0; i < count_; ++i) {
      differences |= reads_[i].activity->word.load(std::memory_order_relaxed) ^ reads_[i].word;
    }
    if (differences != 0 && !were_renewed(clock)) return false;
    if (until_ == kForever) return true;
    if (!clock.is_fresh()) {
      clock.read();
      return clock.reading() < until_;
    }
    if (clock.reading() >= until_) evaluate(clock.reading());
    return true;
  }

  template <class Clock>
  static bool still_denies(const Read& by, const Clock& clock) noexcept {
    if (by.activity->word.load(std::memory_order_relaxed) != by.word) return false;
    if (by.expect_active || !is_finite(by.word)) return true;
    return clock.is_fresh() && is_active(by.word, clock.reading());
  }

  // Whether those that have changed were active, and still are without a break.
  template <class Clock>
  bool were_renewed(const Clock& clock) noexcept {
    for (Word i = 0; i < count_; ++i) {
      Read& read = reads_[i];
      const SeenActivity now = SeenActivity::of(*read.activity);
      if (now.word == read.word) continue;
      const SeenActivity before{read.word, read.breaks, read.breaks};
      if (!before.stands(now, clock.reading())) return false;
      read.word = now.word;
      read.breaks = now.breaks;
      if (is_finite(now.word) && now.word < until_) until_ = now.word;
    }
    return true;
  }

  // The verdict at `time`, if all stand together as they were collected.
  void evaluate(Nanoseconds time) noexcept {
    std::array<std::uint64_t, kActiveWords> active{};
    until_ = kForever;
    denied_by_ = kNobody;
    for (Word i = 0; i < count_; ++i) {
      const Read& read = reads_[i];
      const bool is = is_active(read.word, time);
      if (is) active[i / 64] |= std::uint64_t{1} << (i % 64);
      if (is && is_finite(read.word) && read.word < until_) until_ = read.word;
      if (i < literals_ && is != read.expect_active && denied_by_ == kNobody) denied_by_ = i;
    }
    const bool holds = denied_by_ == kNobody && (!walks_ || walk(active));
    verdict_ = holds ? Verdict::kWins : Verdict::kLoses;
  }

  static constexpr std::size_t kActiveWords = kMaxSourcesPerPort / 64 + 1;
  [[nodiscard]] bool walk(const std::array<std::uint64_t, kActiveWords>& active) const noexcept {
    return walk_holds(nodes_, root_, count_ - own_, max_walk_, [&](Word read) {
      const Word position = read + own_;
      return (active[position / 64] >> (position % 64) & 1) != 0;
    });
  }

  Read* reads_ = nullptr;
  Word count_ = 0;
  Word denied_by_ = kNobody;      // the literal that denies the rule, if one does
  Nanoseconds until_ = kForever;  // when the first of the activities ends
  Verdict verdict_ = Verdict::kLoses;
  bool is_blind_ = false;
  bool was_collected_ = false;
  bool walks_ = false;  // through nodes_
  Word kind_ = table::kNever;
  Word root_ = 0;
  Word max_walk_ = 0;
  Word own_ = 0;  // whether the first of reads_ is the connection's own
  Word literals_ = 0;
  WordList nodes_;
};

// Decides rules that are not kept bound: for a look now and then.
template <class Clock>
class Decider {
 public:
  Decider(const TableView& table, const ActivityPages& pages, Clock& clock) noexcept
      : table_(table), pages_(pages), clock_(clock) {}

  // Whether `rule` selects its connection, whose own activity is taken as given.
  [[nodiscard]] Verdict decide(const Rule& rule) noexcept { return decide(rule, false); }
  // The same with the connection's own activity read too: is it the winner?
  [[nodiscard]] Verdict decide_with_own(const Rule& rule) noexcept { return decide(rule, true); }

 private:
  Verdict decide(const Rule& rule, bool with_own) noexcept {
    BoundRule bound;
    bound.bind(rule, pages_, reads_.data(), with_own);
    return bound.decide(table_, clock_);
  }

  const TableView& table_;
  const ActivityPages& pages_;
  Clock& clock_;
  std::array<Read, kMaxSourcesPerPort + 1> reads_;
};

}  // namespace arbiter::shm
