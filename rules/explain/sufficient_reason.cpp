#include "rules/explain/sufficient_reason.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>
#include <unordered_map>
#include <utility>

#include "rules/model/evaluation.hpp"

namespace arbiter::rules {
namespace {

constexpr std::size_t kNoPlace = static_cast<std::size_t>(-1);

// A reason found along the expression: of what is decided by one operand the one with the smallest
// reason, of what takes all operands all of theirs.
class StructuralReason {
 public:
  // Places of literals in a list, ascending.
  using Places = std::vector<std::uint32_t>;

  // `preferred`: a place, or kNoPlace.
  explicit StructuralReason(const std::vector<Literal>& literals, std::size_t preferred = kNoPlace)
      : literals_(literals), preferred_(preferred), evaluation_([this](const std::string& source) {
          return truth(literals_[place_of(source)].active);
        }) {}

  const Places& of(const Expression& expression) {
    if (const auto known = known_.find(&expression); known != known_.end()) return known->second;
    Places result = find(expression);
    return known_.emplace(&expression, std::move(result)).first->second;
  }
  [[nodiscard]] bool value(const Expression& expression) {
    return evaluation_.of(expression) == Truth::kTrue;
  }

 private:
  [[nodiscard]] std::uint32_t place_of(const std::string& source) const {
    const auto at = std::lower_bound(
        literals_.begin(), literals_.end(), source,
        [](const Literal& literal, const std::string& name) { return literal.source < name; });
    return static_cast<std::uint32_t>(at - literals_.begin());
  }

  Places find(const Expression& expression) {
    const auto& operands = expression.operands;
    switch (expression.op) {
      case Operator::kSource:
        return {place_of(expression.name)};
      case Operator::kAnd:
        return value(expression) ? all_of(operands) : smallest_of(operands, false);
      case Operator::kOr:
        return value(expression) ? smallest_of(operands, true) : all_of(operands);
      case Operator::kImplies:
        return of_implication(*operands[0], *operands[1]);
      default:
        return all_of(operands);
    }
  }

  Places of_implication(const Expression& left, const Expression& right) {
    if (!value(left)) return of(left);
    if (value(right)) return of(right);
    return merge(of(left), of(right));
  }

  Places all_of(const std::vector<ExpressionPtr>& operands) {
    Places result;
    for (const auto& operand : operands) {
      const Places& more = of(*operand);
      result.insert(result.end(), more.begin(), more.end());
    }
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
  }

  // One that is a single literal will do, and spares the others.
  Places smallest_of(const std::vector<ExpressionPtr>& operands, bool wanted) {
    const Places* smallest = nullptr;
    for (const bool literals : {true, false}) {
      for (const auto& operand : operands) {
        if (is_literal(*operand) != literals || value(*operand) != wanted) continue;
        const Places& found = of(*operand);
        if (smallest == nullptr || rank_of(found) < rank_of(*smallest)) smallest = &found;
      }
      if (smallest != nullptr) return *smallest;
    }
    return {};
  }

  [[nodiscard]] std::pair<std::size_t, bool> rank_of(const Places& places) const {
    return {places.size(), !std::binary_search(places.begin(), places.end(), preferred_)};
  }

  static bool is_literal(const Expression& expression) {
    return expression.op == Operator::kSource ||
           (expression.op == Operator::kNot && expression.operands[0]->op == Operator::kSource);
  }

  static Places merge(const Places& left, const Places& right) {
    Places result;
    std::set_union(left.begin(), left.end(), right.begin(), right.end(),
                   std::back_inserter(result));
    return result;
  }

  const std::vector<Literal>& literals_;
  const std::size_t preferred_;
  Evaluation evaluation_;
  std::unordered_map<const Expression*, Places> known_;  // its values stay where they are
};

// A Boolean function of at most kMaxSourcesForSmallest sources, as the set of the activations that
// satisfy it.
class TruthTable {
 public:
  static TruthTable constant(bool value) {
    TruthTable table;
    table.bits_.fill(value ? ~std::uint64_t{0} : 0);
    return table;
  }
  static TruthTable variable(std::size_t number) {
    TruthTable table;
    for (std::size_t row = 0; row < kRows; ++row) {
      if ((row >> number & 1) != 0) table.bits_[row / 64] |= std::uint64_t{1} << (row % 64);
    }
    return table;
  }
  [[nodiscard]] TruthTable operator~() const {
    TruthTable result = *this;
    for (auto& word : result.bits_) word = ~word;
    return result;
  }
  TruthTable& operator&=(const TruthTable& other) {
    for (std::size_t i = 0; i < bits_.size(); ++i) bits_[i] &= other.bits_[i];
    return *this;
  }
  TruthTable& operator|=(const TruthTable& other) {
    for (std::size_t i = 0; i < bits_.size(); ++i) bits_[i] |= other.bits_[i];
    return *this;
  }
  TruthTable& operator^=(const TruthTable& other) {
    for (std::size_t i = 0; i < bits_.size(); ++i) bits_[i] ^= other.bits_[i];
    return *this;
  }
  [[nodiscard]] bool is_never() const {
    return std::all_of(bits_.begin(), bits_.end(), [](std::uint64_t word) { return word == 0; });
  }

 private:
  static constexpr std::size_t kRows = std::size_t{1} << kMaxSourcesForSmallest;
  std::array<std::uint64_t, kRows / 64> bits_{};
};

class Tabulation {
 public:
  explicit Tabulation(const std::vector<Literal>& literals) {
    for (const Literal& literal : literals) {
      variables_.emplace(literal.source, TruthTable::variable(variables_.size()));
    }
  }

  const TruthTable& of(const Expression& expression) {
    if (expression.op == Operator::kSource) return variables_.at(expression.name);
    if (const auto known = known_.find(&expression); known != known_.end()) return known->second;
    const TruthTable result = tabulate(expression);
    return known_.emplace(&expression, result).first->second;
  }
  [[nodiscard]] const TruthTable& variable(const std::string& source) const {
    return variables_.at(source);
  }

 private:
  TruthTable tabulate(const Expression& expression) {
    const auto& operands = expression.operands;
    switch (expression.op) {
      case Operator::kFalse:
      case Operator::kOr: {
        TruthTable result = TruthTable::constant(false);
        for (const auto& operand : operands) result |= of(*operand);
        return result;
      }
      case Operator::kTrue:
      case Operator::kAnd: {
        TruthTable result = TruthTable::constant(true);
        for (const auto& operand : operands) result &= of(*operand);
        return result;
      }
      case Operator::kNot:
        return ~of(*operands[0]);
      case Operator::kXor:
      case Operator::kIff: {
        TruthTable result = of(*operands[0]);
        result ^= of(*operands[1]);
        return expression.op == Operator::kIff ? ~result : result;
      }
      case Operator::kImplies: {
        TruthTable result = ~of(*operands[0]);
        result |= of(*operands[1]);
        return result;
      }
      default:
        throw std::logic_error("a quantifier in an expression that should have been expanded");
    }
  }

  std::map<std::string, TruthTable> variables_;
  std::unordered_map<const Expression*, TruthTable> known_;
};

// Tries all sets of literals, the small ones first.
std::vector<Literal> smallest_reason(const Expression& expression,
                                     const std::vector<Literal>& literals, std::size_t preferred) {
  const bool value = StructuralReason(literals).value(expression);
  Tabulation tabulation(literals);
  TruthTable otherwise = tabulation.of(expression);
  if (value) otherwise = ~otherwise;
  std::vector<TruthTable> tables;
  for (const Literal& literal : literals) {
    const TruthTable& variable = tabulation.variable(literal.source);
    tables.push_back(literal.active ? variable : ~variable);
  }
  std::vector<unsigned> choices(std::size_t{1} << literals.size());
  for (unsigned i = 0; i < choices.size(); ++i) choices[i] = i;
  const auto rank_of = [&](unsigned choice) {
    const bool has_preferred = preferred != kNoPlace && (choice >> preferred & 1) != 0;
    return std::pair(std::popcount(choice), !has_preferred);
  };
  std::stable_sort(choices.begin(), choices.end(),
                   [&](unsigned left, unsigned right) { return rank_of(left) < rank_of(right); });
  for (const unsigned choice : choices) {
    TruthTable left_over = otherwise;
    std::vector<Literal> chosen;
    for (std::size_t i = 0; i < literals.size(); ++i) {
      if ((choice >> i & 1) == 0) continue;
      left_over &= tables[i];
      chosen.push_back(literals[i]);
    }
    if (left_over.is_never()) return chosen;
  }
  return literals;
}

// Leaves out one literal after the other for as long as the rest is enough.
std::vector<Literal> lean_reason(const Expression& expression, bool value,
                                 std::vector<Literal> literals) {
  for (std::size_t i = literals.size(); i-- > 0;) {
    const Literal left_out = literals[i];
    literals.erase(literals.begin() + static_cast<std::ptrdiff_t>(i));
    Evaluation evaluation([&](const std::string& source) {
      for (const Literal& literal : literals) {
        if (literal.source == source) return truth(literal.active);
      }
      return Truth::kUnknown;
    });
    if (evaluation.of(expression) == truth(value)) continue;
    literals.insert(literals.begin() + static_cast<std::ptrdiff_t>(i), left_out);
  }
  return literals;
}

std::vector<Literal> large_reason(const Expression& expression,
                                  const std::vector<Literal>& literals, std::size_t preferred) {
  constexpr std::size_t kMaxLean = 32;  // it takes an evaluation for each
  StructuralReason search(literals, preferred);
  std::vector<Literal> result;
  for (const std::uint32_t place : search.of(expression)) result.push_back(literals[place]);
  if (result.size() > kMaxLean) return result;
  return lean_reason(expression, search.value(expression), std::move(result));
}

}  // namespace

std::vector<Literal> sufficient_reason(const Expression& expression, const IsActive& is_active,
                                       const std::string* preferred) {
  std::set<const Expression*> seen;
  std::set<std::string> sources;
  add_sources_of(expression, sources, seen);
  std::vector<Literal> literals;
  literals.reserve(sources.size());
  std::size_t preferred_at = kNoPlace;
  for (const std::string& source : sources) {
    if (preferred != nullptr && source == *preferred) preferred_at = literals.size();
    literals.push_back({source, is_active(source)});
  }
  return literals.size() <= kMaxSourcesForSmallest
             ? smallest_reason(expression, literals, preferred_at)
             : large_reason(expression, literals, preferred_at);
}

}  // namespace arbiter::rules
