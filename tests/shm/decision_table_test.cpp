#include "shm/decision_table.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "shm/clock.hpp"
#include "shm/decision.hpp"
#include "tests/shm/table_builder.hpp"

namespace arbiter::shm {
namespace {

using test::TableBuilder;
using test::TableWords;

constexpr SourceId kSources = 6;
constexpr PortId kPorts = 3;

std::vector<Word> sample_table() {
  TableBuilder builder;
  builder.conjunction(0, 0, {}, {1, 2}).conjunction(1, 0, {}, {2});
  builder.connect({2, 1, table::kAlways, {}, {}});
  builder.connect({3, 1, table::kNever, {}, {}});
  builder.connect({4,
                   2,
                   table::kDiagram,
                   {0, 1},
                   {0, 1, table::kTrue, 1, table::kFalse, table::kTrue}});  // 0 or 1
  builder.connect({5,
                   2,
                   table::kInOrder,
                   {4, 5},
                   {0, 1, table::kFalse, 1, table::kTrue, 2, 0, table::kTrue, table::kFalse},
                   0,
                   1});
  builder.timeout(5, kForever).timeout(4, 7);
  return builder.words(kSources, kPorts);
}

// Touches everything that a table leads to. Whatever its words say, every index stays inside (the
// address sanitizer watches the exact allocation) and every walk ends.
class Reader {
 public:
  Reader() {
    for (SourceId id = 0; id < kSources; ++id) pages_->attach(id, &activities_[id]);
    activities_[1].word = arrival(1, kForever);
  }

  void read_all(const TableView& view) {
    static_cast<void>(view.is_table());
    for (const Word id : {0u, 1u, 2u, 5u, 6u, 8191u, 0x7fffffffu, kNone - 1, kNone}) {
      const Nanoseconds timeout = view.timeout(id);
      ASSERT_GT(timeout, 0);
      ASSERT_TRUE(timeout <= kMaxTime || timeout == kForever);
      read_list(view.connections_of_source(id));
      read_list(view.ports_concerned(id));
      read_list(view.sources_read(id));
      static_cast<void>(view.knows_source(id) || view.knows_port(id) || view.is_arbitrated(id));
      const auto range = view.connections_to(id);
      ASSERT_LE(range.count, kMaxSourcesPerPort);
      for (Word i = range.first; i < range.first + range.count; ++i) decide(view, i);
      decide(view, id);
      static_cast<void>(view.find(1, id));
    }
  }

 private:
  void decide(const TableView& view, ConnectionIndex index) {
    const Rule rule = view.rule(index);
    ASSERT_TRUE(rule.kind == table::kNever || rule.reads.count <= kMaxSourcesPerPort);
    FixedClock clock(1000);
    Decider decider(view, *pages_, clock);
    static_cast<void>(decider.decide(rule));
    static_cast<void>(decider.decide_with_own(rule));
  }
  static void read_list(const WordList& list) {
    if (list.count == 0) return;
    static_cast<void>(list[0]);
    static_cast<void>(list[list.count - 1]);
  }

  Activity activities_[kSources];
  std::unique_ptr<ActivityPages> pages_ = std::make_unique<ActivityPages>();
};

TEST(DecisionTable, AViewOfNothingKnowsNothing) {
  const TableView view;
  EXPECT_FALSE(view.is_table());
  EXPECT_EQ(view.timeout(0), kDefaultTimeout);
  EXPECT_EQ(view.find(0, 0), kNone);
  EXPECT_EQ(view.connections_to(0).count, 0u);
  EXPECT_EQ(view.rule(0).kind, Word{table::kNever});
  Reader().read_all(view);
}

TEST(DecisionTable, AViewReadsBackWhatWasWritten) {
  const TableWords words(sample_table());
  const TableView view = words.view();
  ASSERT_TRUE(view.is_table());
  EXPECT_EQ(view.connection_count(), 6u);
  EXPECT_EQ(view.timeout(4), 7);
  EXPECT_EQ(view.timeout(5), kForever);
  EXPECT_EQ(view.timeout(0), kDefaultTimeout);
  EXPECT_EQ(view.find(1, 0), 1u);
  EXPECT_EQ(view.find(4, 2), 4u);
  EXPECT_EQ(view.find(4, 1), kNone);
  EXPECT_EQ(view.connections_to(1).first, 2u);
  EXPECT_EQ(view.connections_to(1).count, 2u);
  EXPECT_EQ(view.ports_concerned(1).count, 3u);
  Reader().read_all(view);
}

TEST(DecisionTable, ATableCutAtAnyLengthIsReadWithinItsBounds) {
  const auto whole = sample_table();
  Reader reader;
  for (std::size_t length = 0; length <= whole.size(); ++length) {
    reader.read_all(TableWords({whole.begin(), whole.begin() + static_cast<long>(length)}).view());
  }
}

TEST(DecisionTable, AnySingleWordMayBeGarbage) {
  const auto whole = sample_table();
  Reader reader;
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const Word garbage : {0u, 1u, 3u, 255u, 256u, 257u, 0x7fffffffu, 0x80000000u, 0xfffffffdu,
                               0xfffffffeu, 0xffffffffu, static_cast<Word>(whole.size())}) {
      TableWords words(whole);
      words[at] = garbage;
      reader.read_all(words.view());
    }
  }
}

TEST(DecisionTable, AllWordsMayBeGarbage) {
  constexpr unsigned kSeed = 20250101;
  std::mt19937 random(kSeed);
  Reader reader;
  const auto whole = sample_table();
  for (int round = 0; round < 2000; ++round) {
    TableWords words(whole);
    for (std::size_t i = 0; i < words.size(); ++i) {
      const unsigned kind = random() % 4;  // small numbers lead further than large ones
      if (kind == 0) words[i] = static_cast<Word>(random());
      if (kind == 1) words[i] = static_cast<Word>(random() % (2 * words.size()));
    }
    reader.read_all(words.view());
  }
}

TEST(DecisionTable, WhereAWalkThroughRulesInOrderBeginsIsReadBack) {
  const TableWords words(sample_table());
  const Rule rule = words.view().rule(5);
  EXPECT_EQ(rule.kind, Word{table::kInOrder});
  EXPECT_EQ(rule.root, 0u);
  EXPECT_EQ(rule.before, 1u);
  EXPECT_EQ(words.view().rule(4).before, table::kTrue);
}

TEST(DecisionTable, ADiagramThatRunsInACircleIsCutShort) {
  TableBuilder builder;
  builder.connect({1, 0, table::kInOrder, {2, 1}, {0, 1, 1, 1, 0, 0}, 1, 0});
  builder.connect({0, 0, table::kDiagram, {1, 2}, {0, 1, 1, 1, 0, 0}});
  Reader().read_all(TableWords(builder.words(kSources, 1)).view());
}

}  // namespace
}  // namespace arbiter::shm
