// Smallest reasons, against trying all activations.
#include "rules/explain/sufficient_reason.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/rules/rules_by_hand.hpp"
#include "tests/support/live_table.hpp"

namespace arbiter::test {
namespace {

using rules::Literal;

class Reasons {
 public:
  explicit Reasons(unsigned seed) : random_(seed) {}

  ExpressionPtr expression(const std::vector<std::string>& sources, int depth) {
    const auto pick = [&](std::size_t n) { return random_() % n; };
    if (depth == 0 || pick(5) == 0) {
      if (pick(12) == 0) return rules::make_constant(pick(2) == 0);
      return active(sources[pick(sources.size())]);
    }
    const auto part = [&] { return expression(sources, depth - 1); };
    switch (pick(6)) {
      case 0:
        return negation(part());
      case 1:
        return all_of({part(), part(), part()});
      case 2:
        return any_of({part(), part(), part()});
      case 3:
        return binary(Operator::kXor, part(), part());
      case 4:
        return binary(Operator::kImplies, part(), part());
      default:
        return binary(Operator::kIff, part(), part());
    }
  }

 private:
  std::mt19937 random_;
};

std::vector<Literal> reason_of(const ExpressionPtr& expression, const Active& active) {
  return rules::sufficient_reason(
      *expression, [&](const std::string& source) { return active.contains(source); });
}

bool agrees(const std::vector<Literal>& literals, const Active& active) {
  return std::all_of(literals.begin(), literals.end(), [&](const Literal& literal) {
    return active.contains(literal.source) == literal.active;
  });
}

// Whether the literals alone make the expression what it is under `active`.
bool is_enough(const ExpressionPtr& expression, const std::vector<Literal>& literals,
               const Active& active, const std::vector<Active>& all) {
  const bool value = holds(*expression, active);
  return std::all_of(all.begin(), all.end(), [&](const Active& other) {
    return !agrees(literals, other) || holds(*expression, other) == value;
  });
}

std::size_t smallest_size(const ExpressionPtr& expression, const Active& active,
                          const std::vector<std::string>& sources, const std::vector<Active>& all) {
  std::size_t smallest = sources.size();
  for (const Active& chosen : subsets(sources)) {
    if (chosen.size() >= smallest) continue;
    std::vector<Literal> literals;
    for (const auto& source : chosen) literals.push_back({source, active.contains(source)});
    if (is_enough(expression, literals, active, all)) smallest = chosen.size();
  }
  return smallest;
}

TEST(SufficientReason, IsEnoughAndTheSmallestThatIs) {
  const std::vector<std::string> sources = {"/a", "/b", "/c", "/d"};
  const auto all = subsets(sources);
  Reasons random(1);
  for (int i = 0; i < 300; ++i) {
    const auto expression = random.expression(sources, 3);
    for (const Active& active : all) {
      const auto reason = reason_of(expression, active);
      EXPECT_TRUE(agrees(reason, active));
      EXPECT_TRUE(is_enough(expression, reason, active, all));
      EXPECT_EQ(reason.size(), smallest_size(expression, active, sources, all));
    }
  }
}

TEST(SufficientReason, OfALargeExpressionIsEnoughAndHasNothingThatItsOwnMeaningCouldSpare) {
  std::vector<std::string> sources;
  for (int i = 0; i < 13; ++i) sources.push_back("/s" + std::to_string(i));
  const auto all = subsets(sources);
  Reasons random(2);
  std::size_t literals = 0, most = 0;
  for (int i = 0; i < 25; ++i) {
    // All sources are in it, so that it counts as a large one.
    std::vector<ExpressionPtr> parts;
    for (const auto& source : sources) parts.push_back(active(source));
    const auto whole = any_of({all_of(parts), random.expression(sources, 4)});
    const Active& state = all[static_cast<std::size_t>(i) * 311 % all.size()];
    const auto reason = reason_of(whole, state);
    EXPECT_TRUE(agrees(reason, state));
    EXPECT_TRUE(is_enough(whole, reason, state, all));
    literals += reason.size();
    most += sources.size();
  }
  EXPECT_LT(literals * 3, most) << "a small part of the activation is enough, mostly";
}

TEST(SufficientReason, OfHundredsOfSourcesIsFoundAtOnce) {
  std::vector<ExpressionPtr> sources;
  for (int i = 0; i < 8000; ++i) sources.push_back(active("/s" + std::to_string(i)));
  const auto any = any_of(sources);
  EXPECT_EQ(reason_of(any, {}).size(), 8000u);
  EXPECT_EQ(reason_of(any, {"/s17", "/s4711"}).size(), 1u);
  EXPECT_EQ(reason_of(negation(any), {"/s17"}), (std::vector<Literal>{{"/s17", true}}));
}

TEST(SufficientReason, OfSeveralOfOneSizeHasThePreferredSource) {
  const auto preferring = [](const ExpressionPtr& expression, const Active& active,
                             const std::string& preferred) {
    return rules::sufficient_reason(
        *expression, [&](const std::string& source) { return active.contains(source); },
        &preferred);
  };
  std::vector<ExpressionPtr> many;
  for (int i = 10; i < 40; ++i) many.push_back(active("/s" + std::to_string(i)));
  for (const auto& any : {any_of({active("/s10"), active("/s11"), active("/s12")}), any_of(many)}) {
    const Active two{"/s10", "/s12"};
    EXPECT_EQ(preferring(any, two, "/s10"), (std::vector<Literal>{{"/s10", true}}));
    EXPECT_EQ(preferring(any, two, "/s12"), (std::vector<Literal>{{"/s12", true}}));
    EXPECT_EQ(preferring(any, two, "/s11").size(), 1u) << "it is inactive, and no reason";
    EXPECT_EQ(preferring(any, two, "/other").size(), 1u);
  }
  const auto either = any_of({all_of({active("/a"), active("/b")}), active("/c")});
  EXPECT_EQ(preferring(either, {"/a", "/b", "/c"}, "/a"), (std::vector<Literal>{{"/c", true}}))
      << "the smallest all the same";
}

TEST(SufficientReason, OfWhatIsAlwaysSoIsEmpty) {
  const auto never = all_of({active("/a"), inactive("/a")});
  EXPECT_TRUE(reason_of(never, {}).empty());
  EXPECT_TRUE(reason_of(never, {"/a"}).empty());
  EXPECT_TRUE(reason_of(always(), {}).empty());
}

// A diagram written as an expression shares its parts: written out it would be immense.
TEST(SufficientReason, OfSharedPartsIsFoundAtOnce) {
  ExpressionPtr odd = active("/s0"), even = inactive("/s0");
  for (int i = 1; i < 60; ++i) {
    const std::string source = "/s" + std::to_string(i);
    auto next_odd = any_of({all_of({active(source), even}), all_of({inactive(source), odd})});
    even = any_of({all_of({active(source), odd}), all_of({inactive(source), even})});
    odd = std::move(next_odd);
  }
  EXPECT_EQ(reason_of(odd, {}).size(), 60u);
}

}  // namespace
}  // namespace arbiter::test
