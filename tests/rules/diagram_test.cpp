#include "rules/diagram.hpp"

#include <gtest/gtest.h>

#include <thread>

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
