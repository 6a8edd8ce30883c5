// The flat form of a model's rules: what a model is compiled to, and what publish() and take()
// read.
//
// A table is an array of 32-bit words without pointers; everything is reached by index. It lies in
// the daemon's segment, where its words may be overwritten under a reader that fell seven models
// behind. The reader notices afterwards (table_ring.hpp); until then nothing that it reads may lead
// it astray. Hence every index is checked and every walk is bounded, whatever the words say.
//
//   header        kHeaderWords
//   sources[]     kSourceWords each, by source id: T, connections from it, ports it concerns
//   ports[]       kPortWords each, by port id: flags, connections to it, sources it reads
//   connections[] kConnectionWords each, those of a port side by side, in document order
//   lists         connection indices, port ids, source ids, reads and nodes,
//                 that the above point to
//
// A connection's rule leaves out the connection's own activity: it is implied (paper, section
// III.A).
//   kNever        no rule selects it
//   kAlways       no other source matters
//   kConjunction  reads: each source with the activity it must have
//   kDiagram      reads: the sources that the nodes test, by position;
//                 nodes: {position, low, high}, the walk begins at kRoot,
//                 successors lie behind their node, or are kFalse / kTrue
//   kInOrder      as a diagram; but the walk first goes through the connection's own condition,
//                 and where that holds, from kBefore on, through the rules of the connections
//                 before it, of which none may hold. So it may test a source more than once. The
//                 connections of a port share the nodes, and the reads: each reads the first
//                 kReadCount of them. Where the connection's own source is among these, it counts
//                 as active.
#pragma once

#include <cstdint>

#include "shm/activity.hpp"
#include "shm/atomic.hpp"
#include "shm/ids.hpp"
#include "shm/limits.hpp"

namespace arbiter::shm {

using Word = std::uint32_t;

namespace table {

inline constexpr Word kMagic = 0x54425241;  // "ARBT"
inline constexpr Word kVersion = 2;

// Header, by word.
enum : Word {
  kMagicAt,
  kVersionAt,
  kTotalWordsAt,
  kDefaultTimeoutLowAt,
  kDefaultTimeoutHighAt,
  kSourceCountAt,
  kSourcesAt,
  kPortCountAt,
  kPortsAt,
  kConnectionCountAt,
  kConnectionsAt,
  kHeaderWords = 16
};

// Source record. A source that the model does not know has kSourceKnown = 0 and the default T.
enum : Word {
  kSourceKnown,
  kTimeoutLow,
  kTimeoutHigh,
  kFirstLink,  // list of connection indices
  kLinkCount,
  kFirstConcerned,  // list of port ids: arbitrated ports that it is connected to or that read it
  kConcernedCount,
  kSourceWords = 8
};

// Port record.
enum : Word {
  kPortFlags,
  kFirstConnection,
  kPortConnectionCount,
  kFirstPortRead,  // list of source ids: each one written in the port's rules
  kPortReadCount,
  kPortWords = 8
};
enum : Word { kPortKnown = 1, kPortArbitrated = 2 };

// Connection record.
enum : Word {
  kConnectionSource,
  kConnectionPort,
  kRuleKind,
  kFirstRead,
  kReadCount,
  kFirstNode,
  kNodeCount,
  kRoot,
  kBefore,  // of kInOrder; kTrue where no rule stands before it
  kConnectionWords = 10
};
enum RuleKind : Word { kNever, kAlways, kConjunction, kDiagram, kInOrder };

// A read: a source id, and in a conjunction the activity it must have.
inline constexpr Word kExpectActive = 0x80000000;

// A node.
enum : Word { kNodePosition, kNodeLow, kNodeHigh, kNodeWords };
inline constexpr Word kFalse = 0xfffffffe;
inline constexpr Word kTrue = 0xffffffff;

}  // namespace table

// A run of words inside a table, cut to the table's end.
struct WordList {
  const Atomic<Word>* words = nullptr;
  Word count = 0;

  // The analyzer does not see that where there are no words the count is 0.
  Word operator[](Word i) const noexcept {
    return words[i].load(std::memory_order_relaxed);  // NOLINT(clang-analyzer-core.CallAndMessage)
  }
  [[nodiscard]] bool is(const WordList& other) const noexcept {
    return count == other.count && (words == other.words || count == 0);
  }
};

struct Rule {
  SourceId source = kNone;
  PortId port = kNone;
  Word kind = table::kNever;
  WordList reads;
  WordList nodes;  // count in words
  Word root = 0;
  Word before = table::kTrue;

  // Whether it is the same condition. A table has equal lists once.
  [[nodiscard]] bool decides_as(const Rule& other) const noexcept {
    return kind == other.kind && reads.is(other.reads) && nodes.is(other.nodes) &&
           root == other.root;
  }
};

// Thread safety: none of its own; a view of words that one writer owns. All loads are relaxed:
// what orders them is the generation that leads to the table (table_ring.hpp).
class TableView {
 public:
  TableView() = default;
  TableView(const Atomic<Word>* words, Word capacity) noexcept
      : words_(words), capacity_(capacity) {}

  [[nodiscard]] bool is_table() const noexcept {
    return capacity_ >= table::kHeaderWords && at(table::kMagicAt) == table::kMagic &&
           at(table::kVersionAt) == table::kVersion;
  }
  [[nodiscard]] Word source_count() const noexcept { return header(table::kSourceCountAt); }
  [[nodiscard]] Word port_count() const noexcept { return header(table::kPortCountAt); }
  [[nodiscard]] Word connection_count() const noexcept { return header(table::kConnectionCountAt); }

  [[nodiscard]] bool knows_source(SourceId id) const noexcept {
    const Word record = source_record(id);
    return record != kNone && at(record + table::kSourceKnown) != 0;
  }
  // T of a source: how long an arrival keeps it active. Always one that arrival() can be given.
  [[nodiscard]] Nanoseconds timeout(SourceId id) const noexcept {
    const Word record = source_record(id);
    const bool known = record != kNone && at(record + table::kSourceKnown) != 0;
    const Nanoseconds span =
        span_at(known ? record + table::kTimeoutLow : Word{table::kDefaultTimeoutLowAt});
    const bool possible = span > 0 && (span <= kMaxTime || span == kForever);
    return possible ? span : kDefaultTimeout;
  }
  // The connections from a source, as connection indices.
  [[nodiscard]] WordList connections_of_source(SourceId id) const noexcept {
    return list_of(source_record(id), table::kFirstLink);
  }
  // The arbitrated ports that a source is connected to, or that read it, as port ids.
  [[nodiscard]] WordList ports_concerned(SourceId id) const noexcept {
    return list_of(source_record(id), table::kFirstConcerned);
  }

  [[nodiscard]] bool knows_port(PortId id) const noexcept {
    return (port_flags(id) & table::kPortKnown) != 0;
  }
  [[nodiscard]] bool is_arbitrated(PortId id) const noexcept {
    return (port_flags(id) & table::kPortArbitrated) != 0;
  }
  // The sources written in a port's rules, as source ids.
  [[nodiscard]] WordList sources_read(PortId id) const noexcept {
    return list_of(port_record(id), table::kFirstPortRead);
  }
  // The connections to a port are those from `first` on, `count` of them, in document order.
  struct ConnectionRange {
    ConnectionIndex first = 0;
    Word count = 0;
  };
  [[nodiscard]] ConnectionRange connections_to(PortId id) const noexcept {
    const Word record = port_record(id);
    if (record == kNone) return {};
    const Word first = at(record + table::kFirstConnection);
    const Word count = at(record + table::kPortConnectionCount);
    const Word all = connection_count();
    if (first > all || count > all - first || count > kMaxSourcesPerPort) return {};
    return {first, count};
  }
  [[nodiscard]] ConnectionIndex find(SourceId source, PortId port) const noexcept {
    const auto range = connections_to(port);
    for (ConnectionIndex c = range.first; c < range.first + range.count; ++c) {
      if (at(connection_record(c) + table::kConnectionSource) == source) return c;
    }
    return kNone;
  }

  // Cost: a handful of loads; callers on the data path keep the result for as long as the
  // generation stands.
  [[nodiscard]] Rule rule(ConnectionIndex index) const noexcept {
    const Word record = connection_record(index);
    if (record == kNone) return {};
    Rule rule;
    rule.source = at(record + table::kConnectionSource);
    rule.port = at(record + table::kConnectionPort);
    rule.reads = list_of(record, table::kFirstRead);
    rule.nodes = list_of(record, table::kFirstNode, table::kNodeWords);
    rule.root = at(record + table::kRoot);
    rule.before = at(record + table::kBefore);
    rule.kind = at(record + table::kRuleKind);
    if (rule.reads.count > kMaxSourcesPerPort) rule.kind = table::kNever;
    return rule;
  }

 private:
  [[nodiscard]] Word at(Word index) const noexcept {
    return index < capacity_ ? words_[index].load(std::memory_order_relaxed) : 0;
  }
  [[nodiscard]] Word header(Word field) const noexcept { return at(field); }
  [[nodiscard]] Nanoseconds span_at(Word index) const noexcept {
    return static_cast<Nanoseconds>(std::uint64_t{at(index)} | std::uint64_t{at(index + 1)} << 32);
  }
  [[nodiscard]] Word record(Word base_field, Word count, Word id,
                            Word record_words) const noexcept {
    if (id >= count) return kNone;
    const std::uint64_t index = at(base_field) + std::uint64_t{id} * record_words;
    return index + record_words <= capacity_ ? static_cast<Word>(index) : kNone;
  }
  [[nodiscard]] Word source_record(SourceId id) const noexcept {
    return record(table::kSourcesAt, source_count(), id, table::kSourceWords);
  }
  [[nodiscard]] Word port_record(PortId id) const noexcept {
    return record(table::kPortsAt, port_count(), id, table::kPortWords);
  }
  [[nodiscard]] Word connection_record(ConnectionIndex id) const noexcept {
    return record(table::kConnectionsAt, connection_count(), id, table::kConnectionWords);
  }
  [[nodiscard]] Word port_flags(PortId id) const noexcept {
    const Word record = port_record(id);
    return record == kNone ? 0 : at(record + table::kPortFlags);
  }
  // A record's {first, count} pair at `field`, in units of `unit` words, checked against the table.
  [[nodiscard]] WordList list_of(Word record, Word field, Word unit = 1) const noexcept {
    if (record == kNone) return {};
    const std::uint64_t first = at(record + field);
    const std::uint64_t count = std::uint64_t{at(record + field + 1)} * unit;
    if (first + count > capacity_) return {};
    return {words_ + first, static_cast<Word>(count)};
  }

  const Atomic<Word>* words_ = nullptr;
  Word capacity_ = 0;
};

}  // namespace arbiter::shm
