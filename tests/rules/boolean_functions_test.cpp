// Small domains are enumerated: each Boolean function of three variables goes through the whole
// chain, expression to diagram to flat table to decision, and comes out as its truth table.
#include <gtest/gtest.h>

#include <algorithm>

#include "rules/prove/compile.hpp"
#include "tests/rules/rules_by_hand.hpp"
#include "tests/support/live_table.hpp"

namespace arbiter::test {
namespace {

const std::vector<std::string> kInputs = {"/a", "/b", "/c"};

std::set<std::string> activation(unsigned mask) {
  std::set<std::string> active;
  for (unsigned i = 0; i < 3; ++i) {
    if ((mask >> i & 1) != 0) active.insert(kInputs[i]);
  }
  return active;
}

ExpressionPtr as_minterms(unsigned truth_table) {
  std::vector<ExpressionPtr> terms;
  for (unsigned row = 0; row < 8; ++row) {
    if ((truth_table >> row & 1) == 0) continue;
    std::vector<ExpressionPtr> literals;
    for (unsigned i = 0; i < 3; ++i) {
      literals.push_back((row >> i & 1) != 0 ? active(kInputs[i]) : inactive(kInputs[i]));
    }
    terms.push_back(all_of(std::move(literals)));
  }
  return any_of(std::move(terms));
}

// The same function out of xor and and only (Reed-Muller), so that other operators are met too.
ExpressionPtr as_polynomial(unsigned truth_table) {
  ExpressionPtr sum = rules::make_constant(false);
  for (unsigned monomial = 0; monomial < 8; ++monomial) {
    bool coefficient = false;
    for (unsigned row = 0; row < 8; ++row) {
      if ((row & monomial) == row) coefficient ^= (truth_table >> row & 1) != 0;
    }
    if (!coefficient) continue;
    std::vector<ExpressionPtr> factors;
    for (unsigned i = 0; i < 3; ++i) {
      if ((monomial >> i & 1) != 0) factors.push_back(active(kInputs[i]));
    }
    sum = binary(Operator::kXor, sum, all_of(std::move(factors)));
  }
  return sum;
}

// And once more as nested choices, a → f1 and ¬a → f0, with implies and iff.
ExpressionPtr as_choices(unsigned truth_table, unsigned input, unsigned row) {
  if (input == 3) return rules::make_constant((truth_table >> row & 1) != 0);
  const auto low = as_choices(truth_table, input + 1, row);
  const auto high = as_choices(truth_table, input + 1, row | 1u << input);
  const auto selector = binary(Operator::kIff, active(kInputs[input]), always());
  return all_of({binary(Operator::kImplies, selector, high),
                 binary(Operator::kImplies, negation(selector), low)});
}

void expect_truth_table(unsigned truth_table, const ExpressionPtr& condition,
                        const std::string& own) {
  rules::Diagnostics diagnostics;
  const auto model = rules::compile(RulesByHand().port("/port", {{own, condition}}), diagnostics);
  ASSERT_FALSE(diagnostics.has_errors());
  LiveTable table(model);
  for (unsigned row = 0; row < 8; ++row) {
    auto active_now = activation(row);
    table.activate_only(active_now);
    const bool expected_for_arrival = [&] {
      active_now.insert(own);
      unsigned with_own = 0;
      for (unsigned i = 0; i < 3; ++i) with_own |= unsigned{active_now.contains(kInputs[i])} << i;
      return (truth_table >> with_own & 1) != 0;
    }();
    EXPECT_EQ(table.delivers(own, "/port"), expected_for_arrival)
        << "function " << truth_table << ", row " << row << ", own source " << own;
    const bool own_is_active = own == "/own" ? false : activation(row).contains(own);
    EXPECT_EQ(table.winner("/port").has_value(), own_is_active && expected_for_arrival);
  }
}

TEST(BooleanFunctions, OfThreeVariablesComeOutOfTheChainAsTheirTruthTables) {
  for (unsigned truth_table = 0; truth_table < 256; ++truth_table) {
    expect_truth_table(truth_table, as_minterms(truth_table), "/own");
    expect_truth_table(truth_table, as_polynomial(truth_table), "/own");
    expect_truth_table(truth_table, as_choices(truth_table, 0, 0), "/own");
  }
}

TEST(BooleanFunctions, MayReadTheConnectionsOwnSourceWhichIsThenTrue) {
  for (unsigned truth_table = 0; truth_table < 256; ++truth_table) {
    for (const auto& own : kInputs) expect_truth_table(truth_table, as_minterms(truth_table), own);
  }
}

TEST(BooleanFunctions, OfThreeVariablesGetTheSimplestKindOfRule) {
  for (unsigned truth_table = 0; truth_table < 256; ++truth_table) {
    rules::Diagnostics diagnostics;
    const auto model = rules::compile(
        RulesByHand().port("/port", {{"/own", as_minterms(truth_table)}}), diagnostics);
    const auto& rule = model.ports.at(0).rules.at(0);
    // A cube of n literals has 2^(3-n) rows, which agree in exactly n inputs.
    unsigned rows = 0, all = 7, none = 7;
    for (unsigned row = 0; row < 8; ++row) {
      if ((truth_table >> row & 1) == 0) continue;
      ++rows;
      all &= row;
      none &= ~row;
    }
    const auto literals = static_cast<unsigned>(__builtin_popcount(all | none));
    shm::Word expected =
        rows == 1u << (3 - literals) ? shm::table::kConjunction : shm::table::kDiagram;
    if (truth_table == 0) expected = shm::table::kNever;
    if (truth_table == 255) expected = shm::table::kAlways;
    EXPECT_EQ(rule.kind, expected) << "function " << truth_table;
    if (expected == shm::table::kConjunction) {
      EXPECT_EQ(rule.reads.size(), literals);
      EXPECT_TRUE(rule.nodes.empty());
    }
    for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
      const auto& node = rule.nodes[i];
      EXPECT_LT(node.position, rule.reads.size());
      EXPECT_NE(node.low, node.high);
      EXPECT_GT(node.low, i);
      EXPECT_GT(node.high, i);
    }
  }
}

}  // namespace
}  // namespace arbiter::test
