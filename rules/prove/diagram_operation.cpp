#include "rules/prove/diagram_operation.hpp"

#include <bdd.h>
// Of the two interfaces, that of C is used: BDD is an int.
#undef bdd_ithvar
#undef bdd_nithvar

#include <algorithm>

namespace arbiter::rules {
namespace {

constexpr std::uint64_t pair_of(int left, int right) {
  return static_cast<std::uint64_t>(left) << 32 | static_cast<std::uint32_t>(right);
}

constexpr int kConstantLevel = INT32_MAX;
int level_of(int node) { return node < 2 ? kConstantLevel : bdd_var2level(bdd_var(node)); }

}  // namespace

std::size_t NodePairs::place_of(std::uint64_t pair) const {
  return place_of_pair(pair, entries_.size(),
                       [this](std::size_t place) { return entries_[place].pair; });
}

const int* NodePairs::find(int left, int right) const {
  const Entry& entry = entries_[place_of(pair_of(left, right))];
  return entry.pair == kNoPair ? nullptr : &entry.result;
}

void NodePairs::insert(int left, int right, int result) {
  if (2 * used_.size() >= entries_.size()) grow();
  const std::size_t place = place_of(pair_of(left, right));
  entries_[place] = {pair_of(left, right), bdd_addref(result)};
  used_.push_back(place);
}

void NodePairs::grow() {
  std::vector<Entry> before(2 * entries_.size());
  before.swap(entries_);
  for (std::size_t& place : used_) {
    const Entry entry = before[place];
    place = place_of(entry.pair);
    entries_[place] = entry;
  }
}

void NodePairs::clear(bool instance_has_gone) {
  for (const std::size_t place : used_) {
    if (!instance_has_gone) bdd_delref(entries_[place].result);
    entries_[place] = {};
  }
  used_.clear();
  if (entries_.size() > kKeptEntries) entries_ = std::vector<Entry>(kFirstEntries);
}

int DiagramOperation::apply(int left, int right, int truth_table, const Bounds& bounds) {
  truth_table_ = truth_table;
  bounds_ = bounds;
  return apply(left, right);
}

int DiagramOperation::apply(int left, int right) {
  // Decided, if whatever the other one becomes does not matter.
  const auto outcome = [&](int l, int r) { return truth_table_ >> (2 * l + r) & 1; };
  if (left < 2 && right < 2) return outcome(left, right);
  if (left < 2 && outcome(left, 0) == outcome(left, 1)) return outcome(left, 0);
  if (left < 2 && outcome(left, 1) == 1) return right;
  if (right < 2 && outcome(0, right) == outcome(1, right)) return outcome(0, right);
  if (right < 2 && outcome(1, right) == 1) return left;
  if (left == right && outcome(0, 0) == outcome(1, 1)) return outcome(0, 0);
  if (left == right && outcome(1, 1) == 1) return left;
  if (const int* known = pairs_.find(left, right)) return *known;
  if (pairs_.size() == bounds_.steps) return kTooManySteps;
  const int left_level = level_of(left), right_level = level_of(right);
  const int level = std::min(left_level, right_level);
  const bool split_left = left_level == level, split_right = right_level == level;
  const int low = apply(split_left ? bdd_low(left) : left, split_right ? bdd_low(right) : right);
  if (low < 0) return low;
  const int high = apply(split_left ? bdd_high(left) : left, split_right ? bdd_high(right) : right);
  if (high < 0) return high;
  const int result = make(bdd_level2var(level), low, high);
  if (result >= 0) pairs_.insert(left, right, result);
  return result;
}

int DiagramOperation::restrict(int node, int variable, bool value, const Bounds& bounds) {
  level_ = bdd_var2level(variable);
  value_ = value;
  bounds_ = bounds;
  return restrict(node);
}

int DiagramOperation::restrict(int node) {
  const int level = level_of(node);
  if (level > level_) return node;
  if (level == level_) return value_ ? bdd_high(node) : bdd_low(node);
  if (const int* known = pairs_.find(node, 0)) return *known;
  if (pairs_.size() == bounds_.steps) return kTooManySteps;
  const int low = restrict(bdd_low(node));
  if (low < 0) return low;
  const int high = restrict(bdd_high(node));
  if (high < 0) return high;
  const int result = make(bdd_var(node), low, high);
  if (result >= 0) pairs_.insert(node, 0, result);
  return result;
}

// One step, since the variable stands above both.
int DiagramOperation::make(int variable, int low, int high) {
  if (low == high) return low;
  if (bdd_getnodenum() > bounds_.nodes) return kTooManyNodes;
  return bdd_ite(bdd_ithvar(variable), high, low);
}

std::size_t DiagramOperation::end(bool instance_has_gone) {
  const std::size_t steps = pairs_.size();
  pairs_.clear(instance_has_gone);
  return steps;
}

}  // namespace arbiter::rules
