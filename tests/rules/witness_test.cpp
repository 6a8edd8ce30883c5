// Witnesses against brute force: none shorter where one is called a shortest, and never a literal
// that can be left out.
#include "rules/prove/witness.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <random>

#include "rules/ask/findings.hpp"
#include "rules/prove/compile.hpp"
#include "tests/rules/rules_by_hand.hpp"
#include "tests/support/rounds.hpp"

namespace arbiter::test {
namespace {

using rules::Connective;
using rules::Diagnostics;
using rules::Diagram;
using rules::DiagramBuilder;
using rules::VariableLiteral;
using testing::ElementsAre;

constexpr int kVariables = 4;
constexpr unsigned kRows = 1u << kVariables;

// A function as its truth table: bit `row`, in which bit i stands for variable i.
using Table = std::uint32_t;

Diagram diagram_of(DiagramBuilder& builder, Table table) {
  Diagram function = builder.constant(false);
  for (unsigned row = 0; row < kRows; ++row) {
    if ((table >> row & 1) == 0) continue;
    Diagram term = builder.constant(true);
    for (int i = kVariables; i-- > 0;) {
      const auto with = (row >> i & 1) != 0 ? Connective::kAnd : Connective::kAndNot;
      term = builder.combine(with, term, builder.variable(i));
    }
    function = builder.combine(Connective::kOr, function, term);
  }
  return function;
}

// A conjunction: what must be active, and what must not, as bits.
struct Term {
  unsigned active = 0, inactive = 0;

  [[nodiscard]] Table rows() const {
    Table rows = 0;
    for (unsigned row = 0; row < kRows; ++row) {
      if ((row & active) == active && (row & inactive) == 0) rows |= Table{1} << row;
    }
    return rows;
  }
  [[nodiscard]] std::pair<int, int> size() const {
    return {std::popcount(active | inactive), std::popcount(active)};
  }
  [[nodiscard]] bool implies(Table table) const { return (rows() & ~table) == 0; }
};

Term term_of(const std::vector<VariableLiteral>& literals) {
  Term term;
  for (const auto& literal : literals) {
    (literal.active ? term.active : term.inactive) |= 1u << literal.variable;
  }
  return term;
}

std::pair<int, int> size_of_best(Table function, Table reached) {
  std::pair<int, int> best{99, 99};
  for (unsigned active = 0; active < kRows; ++active) {
    for (unsigned inactive = 0; inactive < kRows; ++inactive) {
      const Term term{active, inactive};
      if ((active & inactive) != 0 || !term.implies(function)) continue;
      if ((term.rows() & reached) != 0) best = std::min(best, term.size());
    }
  }
  return best;
}

TEST(ShortestImplicant, ReachesWhatItIsToWithAsFewLiteralsAsCan) {
  DiagramBuilder builder;
  std::mt19937 random(20261122);
  for (int round = 0; round < rounds(3000); ++round) {
    const Table function = random() & 0xffff, reached = random() & random() & 0xffff;
    if ((function & reached) == 0) continue;
    SCOPED_TRACE(std::to_string(function) + " " + std::to_string(reached));
    rules::ShortestImplicant shortest(builder);
    const auto found =
        shortest.find_literals(diagram_of(builder, function), diagram_of(builder, reached));
    ASSERT_TRUE(found.has_value());
    const Term term = term_of(*found);
    EXPECT_TRUE(term.implies(function));
    EXPECT_NE(term.rows() & reached, 0u);
    EXPECT_EQ(term.size(), size_of_best(function, reached));
  }
}

TEST(ShortestImplicant, AfterItsBoundIsMetSaysSoAndLeavesTheDiagramsAlone) {
  DiagramBuilder builder;
  const Diagram function = diagram_of(builder, 0x6996);  // parity
  EXPECT_FALSE(rules::ShortestImplicant(builder, 3).find(function).has_value());
  EXPECT_EQ(rules::ShortestImplicant(builder).find(function)->count(), 4u);
}

TEST(LeanImplicant, HasNoLiteralThatCanBeLeftOut) {
  DiagramBuilder builder;
  std::mt19937 random(7);
  for (int round = 0; round < rounds(3000); ++round) {
    const Table function = random() & 0xffff, reached = random() & random() & 0xffff;
    if ((function & reached) == 0) continue;
    SCOPED_TRACE(std::to_string(function) + " " + std::to_string(reached));
    const auto literals =
        rules::lean_implicant(builder, diagram_of(builder, function), diagram_of(builder, reached));
    const Term term = term_of(literals);
    EXPECT_TRUE(term.implies(function));
    EXPECT_NE(term.rows() & reached, 0u);
    for (const auto& literal : literals) {
      const unsigned others = ~(1u << literal.variable);
      EXPECT_FALSE((Term{term.active & others, term.inactive & others}.implies(function)));
    }
  }
}

std::vector<rules::Diagnostic> findings_of(const rules::RuleSet& set) {
  Diagnostics diagnostics, more;
  const auto model = compile(set, diagnostics);
  EXPECT_FALSE(diagnostics.has_errors());
  rules::Budget budget;
  find_more(set, model, more, budget);
  return more.items();
}

TEST(Findings, NameCausesOfFewLiteralsBeforeThoseOfMany) {
  const auto parity = binary(Operator::kXor, active("/a"), active("/c"));
  const auto items = findings_of(RulesByHand().port(
      "/p", {{"/a", all_of({active("/b"), active("/c")})}, {"/b", negation(parity)}}, true));
  ASSERT_FALSE(items.empty());
  ASSERT_EQ(items[0].code, "nobody-wins");
  std::vector<rules::Witness> causes{*items[0].witness};
  causes.insert(causes.end(), items[0].more_witnesses.begin(), items[0].more_witnesses.end());
  ASSERT_EQ(causes.size(), 3u);
  std::vector<std::size_t> sizes;
  for (const auto& cause : causes) {
    sizes.push_back(cause.active.size() + cause.inactive.size());
    EXPECT_TRUE(cause.is_shortest);
  }
  EXPECT_THAT(sizes, ElementsAre(2, 2, 3));
  EXPECT_THAT(causes[2].active, ElementsAre("/b", "/c"));
  EXPECT_THAT(causes[2].inactive, ElementsAre("/a"));
}

// Clauses over sources, as an expression and as a diagram.
class Clauses {
 public:
  Clauses(std::size_t count, int sources, unsigned seed) : function_(builder_.constant(true)) {
    std::mt19937 random(seed);
    for (std::size_t c = 0; c < count; ++c) {
      std::vector<ExpressionPtr> literals;
      Diagram clause = builder_.constant(false);
      while (literals.size() < 3) {
        const int source = static_cast<int>(random() % static_cast<unsigned>(sources));
        const bool positive = random() % 2 == 0;
        literals.push_back(positive ? active(name(source)) : inactive(name(source)));
        const Diagram variable = builder_.variable(source);
        clause = builder_.combine(Connective::kOr, clause,
                                  positive ? variable : builder_.negate(variable));
      }
      expressions_.push_back(any_of(literals));
      function_ = builder_.combine(Connective::kAnd, function_, clause);
    }
  }

  [[nodiscard]] ExpressionPtr expression() const { return all_of(expressions_); }

  // Whether all can be true in a state of which `literals` holds.
  bool can_hold(const std::vector<std::pair<std::string, bool>>& literals) {
    Diagram rest = function_;
    for (const auto& [source, is_active] : literals) {
      const int variable = std::stoi(source.substr(2));
      rest = is_active ? builder_.when(rest, variable) : builder_.when_not(rest, variable);
    }
    return !rest.is_false();
  }

 private:
  static std::string name(int source) { return "/s" + std::to_string(source); }

  DiagramBuilder builder_;
  Diagram function_;
  std::vector<ExpressionPtr> expressions_;
};

// Nobody wins with the source active and some clause false: shortest are four literals.
TEST(Findings, OfHardFunctionsNameStatesOfWhichNothingCanBeLeftOut) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    rules::RuleSet set;
    set = RulesByHand().port("/p", {{"/own", Clauses(56, 28, seed).expression()}});
    const auto items = findings_of(set);
    const auto found = std::find_if(items.begin(), items.end(),
                                    [](const auto& item) { return item.code == "nobody-wins"; });
    ASSERT_NE(found, items.end());
    std::vector<rules::Witness> causes{*found->witness};
    causes.insert(causes.end(), found->more_witnesses.begin(), found->more_witnesses.end());
    Clauses clauses(56, 28, seed);
    for (const auto& cause : causes) {
      std::vector<std::pair<std::string, bool>> literals;
      for (const auto& source : cause.inactive) literals.emplace_back(source, false);
      for (const auto& source : cause.active) literals.emplace_back(source, true);
      ASSERT_EQ(std::erase(literals, std::pair(std::string("/own"), true)), 1u);
      EXPECT_FALSE(clauses.can_hold(literals));
      for (std::size_t i = 0; i < literals.size(); ++i) {
        auto less = literals;
        less.erase(less.begin() + static_cast<std::ptrdiff_t>(i));
        EXPECT_TRUE(clauses.can_hold(less)) << literals[i].first << " can be left out";
      }
    }
    if (causes.front().is_shortest) {
      EXPECT_LE(causes.front().active.size() + causes.front().inactive.size(), 4u);
    }
  }
}

}  // namespace
}  // namespace arbiter::test
