#include "rules/prove/diagram.hpp"

#include <gtest/gtest.h>

#include <random>
#include <thread>
#include <vector>

namespace arbiter::test {
namespace {

using rules::Connective;
using rules::Diagram;
using rules::DiagramBuilder;
using rules::DiagramLimit;

// x0 = y0 and x1 = y1 and …, all x before all y.
Diagram equalities(DiagramBuilder& builder, int pairs) {
  Diagram all = builder.constant(true);
  for (int i = 0; i < pairs; ++i) {
    const auto equal =
        builder.combine(Connective::kIff, builder.variable(i), builder.variable(pairs + i));
    all = builder.combine(Connective::kAnd, all, equal);
  }
  return all;
}

// Has no small diagram in any order: the middle bit of the product of two numbers.
void build_product(DiagramBuilder& builder, int bits) {
  std::vector<Diagram> sum(static_cast<std::size_t>(2 * bits), builder.constant(false));
  for (int i = 0; i < bits; ++i) {
    Diagram carry = builder.constant(false);
    for (int j = 0; j < bits; ++j) {
      const auto product =
          builder.combine(Connective::kAnd, builder.variable(i), builder.variable(bits + j));
      auto& digit = sum[static_cast<std::size_t>(i + j)];
      const auto half = builder.combine(Connective::kXor, digit, product);
      const auto both = builder.combine(Connective::kAnd, digit, product);
      const auto over = builder.combine(Connective::kAnd, half, carry);
      digit = builder.combine(Connective::kXor, half, carry);
      carry = builder.combine(Connective::kOr, both, over);
    }
    sum[static_cast<std::size_t>(i + bits)] = carry;
  }
}

TEST(Diagram, TheSameFunctionIsTheSameDiagram) {
  DiagramBuilder builder;
  const auto a = builder.variable(0), b = builder.variable(1);
  const auto left = builder.negate(builder.combine(Connective::kAnd, a, b));
  const auto right = builder.combine(Connective::kOr, builder.negate(a), builder.negate(b));
  EXPECT_EQ(left, right);
  EXPECT_TRUE(builder.combine(Connective::kXor, left, right).is_false());
  EXPECT_TRUE(builder.combine(Connective::kImplies, left, right).is_true());
  EXPECT_TRUE(builder.combine(Connective::kAndNot, left, right).is_false());
}

// Functions of five variables, each beside its table of values: bit i is the value in state i.
struct Function {
  Diagram diagram;
  std::uint32_t values;
};
constexpr int kSmall = 5;

std::uint32_t values_of_variable(int variable) {
  std::uint32_t values = 0;
  for (std::uint32_t state = 0; state < 32; ++state) values |= (state >> variable & 1) << state;
  return values;
}

std::uint32_t combine(Connective connective, std::uint32_t a, std::uint32_t b) {
  switch (connective) {
    case Connective::kAnd:
      return a & b;
    case Connective::kOr:
      return a | b;
    case Connective::kXor:
      return a ^ b;
    case Connective::kImplies:
      return ~a | b;
    case Connective::kIff:
      return ~(a ^ b);
    case Connective::kAndNot:
      return a & ~b;
  }
  return 0;
}

std::uint32_t restrict(std::uint32_t values, int variable, bool value) {
  std::uint32_t result = 0;
  for (std::uint32_t state = 0; state < 32; ++state) {
    const std::uint32_t read = value ? state | 1u << variable : state & ~(1u << variable);
    result |= (values >> read & 1) << state;
  }
  return result;
}

bool evaluate(DiagramBuilder& builder, const Diagram& function, std::uint32_t state) {
  Diagram at = function;
  while (!at.is_false() && !at.is_true()) {
    at = state >> builder.top_variable(at) & 1 ? builder.high(at) : builder.low(at);
  }
  return at.is_true();
}

TEST(Diagram, OperationsAreThoseOfTheirTables) {
  DiagramBuilder builder;
  std::mt19937 random(7);
  std::vector<Function> functions{{builder.constant(false), 0}, {builder.constant(true), ~0u}};
  for (int variable = 0; variable < kSmall; ++variable) {
    functions.push_back({builder.variable(variable), values_of_variable(variable)});
  }
  for (int step = 0; step < 2000; ++step) {
    const Function a = functions[random() % functions.size()];
    const Function b = functions[random() % functions.size()];
    const auto connective = static_cast<Connective>(random() % 6);
    const int variable = static_cast<int>(random() % kSmall);
    const std::uint32_t chosen = values_of_variable(variable);
    functions.push_back({builder.combine(connective, a.diagram, b.diagram),
                         combine(connective, a.values, b.values)});
    functions.push_back({builder.negate(a.diagram), ~a.values});
    functions.push_back({builder.when(a.diagram, variable), restrict(a.values, variable, true)});
    functions.push_back(
        {builder.when_not(a.diagram, variable), restrict(a.values, variable, false)});
    functions.push_back({builder.choose(variable, a.diagram, b.diagram),
                         (a.values & chosen) | (b.values & ~chosen)});
    if (step % 500 == 0) builder.sift();
  }
  for (const Function& function : functions) {
    for (std::uint32_t state = 0; state < 32; ++state) {
      ASSERT_EQ(evaluate(builder, function.diagram, state), (function.values >> state & 1) != 0);
    }
  }
}

// The parities of all rows and all columns of a square. It has few nodes; BuDDy's own operations
// forget what they have computed of it, and with a side of 8 do not end.
Diagram parities(DiagramBuilder& builder, int side) {
  Diagram all = builder.constant(true);
  for (const bool rows : {true, false}) {
    for (int i = 0; i < side; ++i) {
      Diagram odd = builder.constant(false);
      for (int j = 0; j < side; ++j) {
        const int cell = rows ? i * side + j : j * side + i;
        odd = builder.combine(Connective::kXor, odd, builder.variable(cell));
      }
      all = builder.combine(Connective::kAnd, all, odd);
    }
  }
  return all;
}

TEST(Diagram, NoPairOfNodesIsCombinedTwice) {
  DiagramBuilder builder;
  const Diagram odd = parities(builder, 8);
  EXPECT_FALSE(builder.when(odd, 3).is_false());
  EXPECT_FALSE(builder.when_not(odd, 60).is_false());
  EXPECT_TRUE(builder.combine(Connective::kAnd, odd, builder.negate(odd)).is_false());
}

TEST(Diagram, AllOperationsTogetherHaveABoundOfSteps) {
  rules::Budget budget(1'000'000);
  DiagramBuilder builder(budget, 64, false);
  const auto use_up = [&] {
    for (int i = 0; i < 100'000; ++i) static_cast<void>(parities(builder, 6));
  };
  EXPECT_THROW(use_up(), DiagramLimit);
  EXPECT_THROW(static_cast<void>(parities(builder, 6)), DiagramLimit);
}

TEST(Diagram, AFunctionThatOutgrowsTheTableIsAnExceptionAndTheBuilderGoesOn) {
  DiagramBuilder builder;
  const Diagram lost = builder.combine(Connective::kAnd, builder.variable(0), builder.variable(1));
  EXPECT_THROW(build_product(builder, 20), DiagramLimit);
  EXPECT_THROW(static_cast<void>(builder.negate(lost)), std::logic_error);
  const auto again = equalities(builder, 4);
  EXPECT_FALSE(again.is_false());
}

TEST(Diagram, SiftingKeepsTheFunctionAndMakesItSmall) {
  DiagramBuilder builder;
  const Diagram function = equalities(builder, 11);
  const std::size_t before = builder.node_count(function);
  builder.sift();
  EXPECT_LT(builder.node_count(function), before / 10);
  const auto nodes = builder.nodes(function);
  EXPECT_EQ(nodes.nodes.size(), builder.node_count(function));
  for (std::size_t i = 1; i < nodes.nodes.size(); ++i) {
    EXPECT_LE(nodes.nodes[i - 1].level, nodes.nodes[i].level);
  }
}

TEST(Diagram, TheOrderOfOnePortIsNoConcernOfTheNext) {
  DiagramBuilder builder;
  const Diagram function = equalities(builder, 11);
  builder.sift();
  builder.restore_order();
  for (int variable = 0; variable < DiagramBuilder::kVariables; ++variable) {
    EXPECT_EQ(builder.level_of(variable), variable);
  }
}

TEST(Diagram, TakenOutItEndsInTheConstants) {
  DiagramBuilder builder;
  EXPECT_EQ(builder.nodes(builder.constant(true)).root, shm::table::kTrue);
  EXPECT_EQ(builder.nodes(builder.constant(false)).root, shm::table::kFalse);
  const auto nodes = builder.nodes(builder.negate(builder.variable(5)));
  ASSERT_EQ(nodes.nodes.size(), 1u);
  EXPECT_EQ(nodes.nodes[0].variable, 5);
  EXPECT_EQ(nodes.nodes[0].low, shm::table::kTrue);
  EXPECT_EQ(nodes.nodes[0].high, shm::table::kFalse);
}

TEST(Diagram, ThreadsTakeTurns) {
  const auto work = [] {
    for (int i = 0; i < 20; ++i) {
      DiagramBuilder builder;
      EXPECT_EQ(builder.node_count(equalities(builder, 6)), 3u * (1u << 6) - 3u);
    }
  };
  std::thread other(work);
  work();
  other.join();
}

}  // namespace
}  // namespace arbiter::test
