#include "rules/witness.hpp"

#include <algorithm>

namespace arbiter::rules {
namespace {

constexpr std::uint32_t kImpossible = 1u << 30;
constexpr std::uint32_t kLiteral = 4096;  // more than there can be active literals
constexpr std::uint32_t kActiveLiteral = kLiteral + 1;
static_assert(kLiteral > DiagramBuilder::kMaxVariables);

struct BoundMet {};

}  // namespace

std::uint32_t ShortestImplicant::cost(const Diagram& function) {
  if (function.is_true()) return 0;
  if (function.is_false()) return kImpossible;
  if (const auto known = best_.find(function.id()); known != best_.end()) return known->second.cost;
  if (best_.size() >= kMaxFunctions) throw BoundMet();

  const int variable = builder_.top_variable(function);
  const Diagram low = builder_.low(function);
  const Diagram high = builder_.high(function);
  const Diagram either = builder_.combine(Connective::kAnd, low, high);
  Best best{cost(either), Choice::kLeaveOut, variable, either, function};
  const auto consider = [&](Choice choice, std::uint32_t literal, const Diagram& rest) {
    if (best.cost <= literal) return;
    const std::uint32_t with = literal + cost(rest);
    if (with < best.cost) best = {with, choice, variable, rest, function};
  };
  // Where one half implies the other, saying that x is on the larger side says nothing more.
  if (either != low) consider(Choice::kInactive, kLiteral, low);
  if (either != high) consider(Choice::kActive, kActiveLiteral, high);
  return best_.emplace(function.id(), std::move(best)).first->second.cost;
}

std::optional<Literals> ShortestImplicant::find(const Diagram& function) {
  const auto literals = find_literals(function);
  if (!literals) return std::nullopt;
  Literals result;
  for (const VariableLiteral& literal : *literals) {
    (literal.active ? result.active : result.inactive)
        .set(static_cast<std::size_t>(literal.variable));
  }
  return result;
}

std::optional<std::vector<VariableLiteral>> ShortestImplicant::find_literals(
    const Diagram& function) {
  try {
    cost(function);
  } catch (const BoundMet&) {
    return std::nullopt;
  }
  std::vector<VariableLiteral> result;
  for (Diagram rest = function; !rest.is_true();) {
    const Best& best = best_.at(rest.id());
    if (best.choice != Choice::kLeaveOut) {
      result.push_back({best.variable, best.choice == Choice::kActive});
    }
    rest = best.rest;
  }
  return result;
}

}  // namespace arbiter::rules
