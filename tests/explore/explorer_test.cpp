// The explorer itself: what it leaves out, another execution stands for.
#include "tests/explore/explorer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <set>
#include <vector>

#include "shm/atomic.hpp"

namespace arbiter::explore {
namespace {

struct Operation {
  enum Kind { kLoad, kStore, kAdd, kFence } kind;
  std::size_t word;
  bool is_ordered;
};
using Program = std::vector<Operation>;  // of a thread
using Outcome = std::vector<std::uint64_t>;
using Words = std::array<shm::Atomic<std::uint64_t>, 3>;

void run(const Program& program, std::uint64_t value, Words& words, Outcome& seen) {
  const auto ordered = [](const Operation& each, std::memory_order order) {
    return each.is_ordered ? order : std::memory_order_relaxed;
  };
  for (const Operation& each : program) {
    auto& word = words[each.word];
    switch (each.kind) {
      case Operation::kLoad:
        seen.push_back(word.load(ordered(each, std::memory_order_acquire)));
        break;
      case Operation::kStore:
        word.store(++value, ordered(each, std::memory_order_release));
        break;
      case Operation::kAdd:
        seen.push_back(word.fetch_add(++value, ordered(each, std::memory_order_acq_rel)));
        break;
      case Operation::kFence:
        shm::full_fence();
        break;
    }
  }
}

// What the threads have read, and what the words are at the end, in each execution. The first
// thread may die.
std::set<Outcome> outcomes(const std::vector<Program>& programs, const Limits& limits,
                           std::uint64_t& executions) {
  std::set<Outcome> all;
  Words words;
  std::vector<Outcome> seen(programs.size());
  const Report report = Explorer(limits).run([&](Execution& execution) {
    for (auto& word : words) word.store(0, std::memory_order_relaxed);
    for (std::size_t i = 0; i < programs.size(); ++i) {
      seen[i].clear();
      const auto body = [&, i] { run(programs[i], i * 1000, words, seen[i]); };
      i == 0 ? execution.mortal_thread(body) : execution.thread(body);
    }
    execution.finally([&] {
      Outcome outcome;
      for (const Outcome& each : seen) {
        outcome.push_back(each.size());
        outcome.insert(outcome.end(), each.begin(), each.end());
      }
      for (const auto& word : words) outcome.push_back(word.load(std::memory_order_relaxed));
      all.insert(outcome);
    });
  });
  EXPECT_EQ(report.failure, "");
  EXPECT_TRUE(report.complete);
  executions += report.executions;
  return all;
}

TEST(Explorer, SeesEachOutcomeThoughItLeavesExecutionsThatOthersStandFor) {
  std::mt19937 random(1);
  const auto pick = [&](std::uint32_t count) {
    return static_cast<std::uint32_t>(random() % count);
  };
  std::uint64_t all = 0, needed = 0;
  for (int round = 0; round < 300; ++round) {
    SCOPED_TRACE(round);
    std::vector<Program> programs(2 + pick(2));
    for (Program& program : programs) {
      for (std::uint32_t left = 2 + pick(2); left != 0; --left) {
        program.push_back({static_cast<Operation::Kind>(pick(4)), pick(3), pick(2) == 0});
      }
    }
    Limits limits;
    limits.preemptions = 1 + static_cast<int>(pick(3));
    limits.halts = static_cast<int>(pick(2));
    const auto outcomes_if = [&](bool leaves, std::uint64_t& executions) {
      limits.leaves_redundant = leaves;
      return outcomes(programs, limits, executions);
    };
    const auto expected = outcomes_if(false, all);
    ASSERT_EQ(outcomes_if(true, needed), expected);
  }
  EXPECT_LT(needed, all);
}

}  // namespace
}  // namespace arbiter::explore
