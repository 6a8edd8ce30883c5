#include "rules/prove/proof.hpp"

#include <algorithm>

namespace arbiter::rules {
namespace {

using shm::table::kFalse;
using shm::table::kTrue;

// Node by node from the end, as successors lie behind: what a node implies is what its sole
// possible branch implies, with the literal that takes it there, or what both branches imply.
std::vector<Literals> implied_by_each(const DiagramNodes& function) {
  std::vector<Literals> implied(function.nodes.size());
  const auto of = [&](shm::Word node) { return node == kTrue ? Literals{} : implied[node]; };
  for (std::size_t i = function.nodes.size(); i-- > 0;) {
    const auto& node = function.nodes[i];
    const auto variable = static_cast<std::size_t>(node.variable);
    if (node.low == kFalse) {
      implied[i] = of(node.high);
      implied[i].active.set(variable);
    } else if (node.high == kFalse) {
      implied[i] = of(node.low);
      implied[i].inactive.set(variable);
    } else {
      const Literals low = of(node.low), high = of(node.high);
      implied[i] = {low.active & high.active, low.inactive & high.inactive};
    }
  }
  return implied;
}

}  // namespace

void NodePairSet::clear() {
  slots_.assign(kFirstSlots, kNoPair);
  used_ = 0;
}

std::size_t NodePairSet::place_of(std::uint64_t pair) const {
  return place_of_pair(pair, slots_.size(), [this](std::size_t place) { return slots_[place]; });
}

void NodePairSet::insert(std::uint64_t pair) {
  if (used_ >= slots_.size() / 4 * 3) {
    std::vector<std::uint64_t> before;
    if (slots_.size() < max_slots_) before.swap(slots_);
    slots_.assign(std::max(2 * before.size(), slots_.size()), kNoPair);
    used_ = 0;
    for (const std::uint64_t each : before) {
      if (each != kNoPair) insert(each);
    }
  }
  slots_[place_of(pair)] = pair;
  ++used_;
}

bool exclude_each_other(const Literals& a, const Literals& b) {
  return (a.active & b.inactive).any() || (a.inactive & b.active).any();
}

DiagramNodes VariableNumbers::number(DiagramNodes function) {
  for (auto& node : function.nodes) {
    const auto variable = static_cast<std::size_t>(node.variable);
    if (variable >= numbers_.size()) numbers_.resize(variable + 1, -1);
    int& number = numbers_[variable];
    if (number < 0) {
      number = static_cast<int>(variables_.size());
      variables_.push_back(node.variable);
    }
    node.variable = number;
  }
  return function;
}

Literals implied_literals(const DiagramNodes& function) {
  if (function.root >= kFalse) return {};
  return implied_by_each(function).front();
}

bool holds_given(const DiagramNodes& function, const Literals& given) {
  if (function.root >= kFalse) return function.root == kTrue;
  std::vector<bool> reached(function.nodes.size());
  reached[0] = true;
  for (std::size_t i = 0; i < function.nodes.size(); ++i) {
    if (!reached[i]) continue;
    const auto& node = function.nodes[i];
    const auto variable = static_cast<std::size_t>(node.variable);
    const auto reach = [&](shm::Word next) {
      if (next < kFalse) reached[next] = true;
      return next != kFalse;
    };
    if (!given.active[variable] && !reach(node.low)) return false;
    if (!given.inactive[variable] && !reach(node.high)) return false;
  }
  return true;
}

std::vector<Proof::Pair> Proof::pairs_that_meet(const std::vector<DiagramNodes>& functions) {
  std::vector<Literals> implied;
  implied.reserve(functions.size());
  for (const auto& function : functions) implied.push_back(implied_literals(function));
  std::vector<Pair> result;
  for (std::size_t second = 0; second < functions.size(); ++second) {
    for (std::size_t first = 0; first < second; ++first) {
      if (exclude_each_other(implied[first], implied[second])) continue;
      if (meet(functions[first], functions[second])) result.emplace_back(first, second);
    }
  }
  return result;
}

Literals Proof::meeting_point(const DiagramNodes& a, const DiagramNodes& b) {
  const Budget::Overdraft overdraft(budget_);
  if (!meet(a, b)) return {};
  Literals point = path_;
  const auto leave_out = [&](VariableSet& side) {
    for (std::size_t variable = 0; variable < side.size(); ++variable) {
      if (!side[variable]) continue;
      side.reset(variable);
      if (!holds_given(a, point) || !holds_given(b, point)) side.set(variable);
    }
  };
  leave_out(point.active);
  leave_out(point.inactive);
  return point;
}

bool Proof::meet(const DiagramNodes& a, const DiagramNodes& b) {
  apart_.clear();
  path_ = {};
  return walk(a, a.root, b, b.root);
}

bool Proof::walk(const DiagramNodes& a, shm::Word at_a, const DiagramNodes& b, shm::Word at_b) {
  if (at_a == kFalse || at_b == kFalse) return false;
  if (at_a == kTrue && at_b == kTrue) return true;
  budget_.spend(1);
  const std::uint64_t both = std::uint64_t{at_a} << 32 | at_b;
  if (apart_.contains(both)) return false;

  const bool steps_a =
      at_b == kTrue || (at_a != kTrue && a.nodes[at_a].level <= b.nodes[at_b].level);
  const bool steps_b =
      at_a == kTrue || (at_b != kTrue && b.nodes[at_b].level <= a.nodes[at_a].level);
  const auto variable =
      static_cast<std::size_t>(steps_a ? a.nodes[at_a].variable : b.nodes[at_b].variable);
  for (const bool high : {false, true}) {
    const auto next = [&](const DiagramNodes& of, shm::Word at, bool steps) {
      if (!steps) return at;
      return high ? of.nodes[at].high : of.nodes[at].low;
    };
    auto& side = high ? path_.active : path_.inactive;
    side.set(variable);
    if (walk(a, next(a, at_a, steps_a), b, next(b, at_b, steps_b))) return true;
    side.reset(variable);
  }
  apart_.insert(both);
  return false;
}

}  // namespace arbiter::rules
