#include "rules/prove/witness.hpp"

#include <algorithm>
#include <utility>

namespace arbiter::rules {
namespace {

constexpr std::uint32_t kImpossible = 1u << 30;
constexpr std::uint32_t kLiteral = 4096;  // more than there can be active literals
constexpr std::uint32_t kActiveLiteral = kLiteral + 1;
static_assert(kLiteral > DiagramBuilder::kMaxVariables);

struct BoundMet {};

// What a conjunction says of each variable.
enum class Said : std::uint8_t { kNothing, kInactive, kActive };

bool is_implied(const DiagramNodes& function, const std::vector<Said>& said) {
  using shm::table::kFalse;
  if (function.root >= kFalse) return function.root == shm::table::kTrue;
  std::vector<bool> met(function.nodes.size());
  met[0] = true;
  for (std::size_t i = 0; i < function.nodes.size(); ++i) {
    if (!met[i]) continue;
    const auto& node = function.nodes[i];
    const Said here = said[static_cast<std::size_t>(node.variable)];
    for (const auto& [next, against] :
         {std::pair(node.low, Said::kActive), std::pair(node.high, Said::kInactive)}) {
      if (here == against) continue;
      if (next == kFalse) return false;
      if (next < kFalse) met[next] = true;
    }
  }
  return true;
}

}  // namespace

std::uint64_t ShortestImplicant::Goal::key() const {
  return static_cast<std::uint64_t>(function.id()) << 32 | static_cast<std::uint32_t>(reached.id());
}

// Variables that the function does not depend on are no part of a shortest implicant.
ShortestImplicant::Goal ShortestImplicant::without_what_is_above(Goal goal) {
  const int level = builder_.level_of(builder_.top_variable(goal.function));
  while (!goal.reached.is_true() && !goal.reached.is_false() &&
         builder_.level_of(builder_.top_variable(goal.reached)) < level) {
    goal.reached =
        builder_.combine(Connective::kOr, builder_.low(goal.reached), builder_.high(goal.reached));
  }
  return goal;
}

std::uint32_t ShortestImplicant::cost(const Goal& goal, std::uint32_t limit) {
  if (goal.is_impossible()) return kImpossible;
  if (goal.function.is_true()) return 0;
  if (limit <= kLiteral) return kLiteral;
  const auto known = best_.find(goal.key());
  if (known != best_.end() && (known->second.is_exact || known->second.cost >= limit)) {
    return known->second.cost;
  }
  if (++splits_ > max_splits_ || builder_.steps() > first_step_ + kMaxSteps) throw BoundMet();
  Best best = split(goal, limit);
  const std::uint32_t cost = best.cost;
  best_.insert_or_assign(goal.key(), std::move(best));
  return cost;
}

ShortestImplicant::Best ShortestImplicant::split(const Goal& goal, std::uint32_t limit) {
  const auto [function, reached] = without_what_is_above(goal);
  const int variable = builder_.top_variable(function);
  const bool splits =
      !reached.is_true() && !reached.is_false() &&
      builder_.level_of(builder_.top_variable(reached)) == builder_.level_of(variable);
  const Goal low{builder_.low(function), splits ? builder_.low(reached) : reached};
  const Goal high{builder_.high(function), splits ? builder_.high(reached) : reached};
  Goal either{builder_.combine(Connective::kAnd, low.function, high.function), reached};
  if (splits) either.reached = builder_.combine(Connective::kOr, low.reached, high.reached);
  // Where one half implies the other, saying that x is on the larger side says nothing more.
  const bool may_be_low = either.function != low.function;
  const bool may_be_high = either.function != high.function;

  Best best{cost(either, limit), true, Choice::kLeaveOut, variable, std::move(either), goal};
  const auto consider = [&](Choice choice, std::uint32_t literal, const Goal& rest) {
    const std::uint32_t most = std::min(best.cost, limit);
    if (most <= literal) {
      if (!rest.is_impossible()) best.cost = std::min(best.cost, literal);
      return;
    }
    const std::uint32_t with = std::min(kImpossible, literal + cost(rest, most - literal));
    if (with < best.cost) best = {with, true, choice, variable, rest, goal};
  };
  if (may_be_low) consider(Choice::kInactive, kLiteral, low);
  if (may_be_high) consider(Choice::kActive, kActiveLiteral, high);
  best.is_exact = best.cost < limit || best.cost == kImpossible;
  return best;
}

std::optional<Literals> ShortestImplicant::find(const Diagram& function) {
  const auto literals = find_literals(function, builder_.constant(true));
  if (!literals) return std::nullopt;
  Literals result;
  for (const VariableLiteral& literal : *literals) {
    (literal.active ? result.active : result.inactive)
        .set(static_cast<std::size_t>(literal.variable));
  }
  return result;
}

std::optional<std::vector<VariableLiteral>> ShortestImplicant::find_literals(
    const Diagram& function, const Diagram& reached) {
  const Goal goal{function, reached};
  try {
    std::uint32_t limit = kLiteral;
    while (cost(goal, limit) >= limit && limit < kImpossible) limit += kLiteral;
  } catch (const BoundMet&) {
    return std::nullopt;
  }
  std::vector<VariableLiteral> result;
  for (Goal rest = goal; !rest.function.is_true();) {
    const Best& best = best_.at(rest.key());
    if (best.choice != Choice::kLeaveOut) {
      result.push_back({best.variable, best.choice == Choice::kActive});
    }
    rest = best.rest;
  }
  return result;
}

std::vector<VariableLiteral> lean_implicant(DiagramBuilder& builder, const Diagram& function,
                                            const Diagram& reached) {
  std::vector<VariableLiteral> literals;
  std::vector<Said> said(DiagramBuilder::kMaxVariables, Said::kNothing);
  for (Diagram rest = builder.combine(Connective::kAnd, function, reached); !rest.is_true();) {
    const int variable = builder.top_variable(rest);
    const bool active = builder.low(rest).is_false();
    literals.push_back({variable, active});
    said[static_cast<std::size_t>(variable)] = active ? Said::kActive : Said::kInactive;
    rest = active ? builder.high(rest) : builder.low(rest);
  }
  const DiagramNodes nodes = builder.nodes(function);
  for (const bool active : {true, false}) {
    std::erase_if(literals, [&](const VariableLiteral& literal) {
      if (literal.active != active) return false;
      Said& here = said[static_cast<std::size_t>(literal.variable)];
      const Said before = std::exchange(here, Said::kNothing);
      if (is_implied(nodes, said)) return true;
      here = before;
      return false;
    });
  }
  return literals;
}

}  // namespace arbiter::rules
