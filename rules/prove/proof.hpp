// The proof that at most one connection of a port can win: for no two of them is there an
// activation of the sources under which both rules hold.
//
// One diagram for a whole port would show this at once, but it explodes where connections are
// inhibited by a few others each. So pairs are looked at, and nearly all of them cost a few machine
// words: two functions exclude each other if one of them implies a literal whose opposite the other
// implies, as inhibition makes them do. For the rest both diagrams are walked side by side.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "rules/prove/diagram.hpp"
#include "rules/prove/pair_table.hpp"

namespace arbiter::rules {

using VariableSet = std::bitset<shm::kMaxSourcesPerPort>;

// A conjunction of literals, by variable.
struct Literals {
  VariableSet active;
  VariableSet inactive;

  [[nodiscard]] std::size_t count() const { return active.count() + inactive.count(); }
};

// All literals that the function implies; none if it is false, since it then implies everything.
Literals implied_literals(const DiagramNodes& function);

// Variables by numbers of their own, in the order in which they are met: functions over an order
// that has more of them than a VariableSet may still be of few.
class VariableNumbers {
 public:
  // The function with these in place of its variables.
  DiagramNodes number(DiagramNodes function);
  // By number.
  [[nodiscard]] const std::vector<int>& variables() const { return variables_; }

 private:
  std::vector<int> numbers_;  // by variable; -1: none yet
  std::vector<int> variables_;
};

// Whether one says of some variable the opposite of the other.
bool exclude_each_other(const Literals& a, const Literals& b);

// Whether the function holds under each activation in which `given` holds.
bool holds_given(const DiagramNodes& function, const Literals& given);

// Pairs of nodes. When there are too many, all of them are forgotten: whoever goes by them takes
// more steps then, which a budget bounds, and not more memory, which nothing else would.
class NodePairSet {
 public:
  // 256 MiB, and half as much again while it grows.
  static constexpr std::size_t kMaxSlots = std::size_t{1} << 25;

  explicit NodePairSet(std::size_t max_slots) : max_slots_(max_slots) { clear(); }

  void clear();
  [[nodiscard]] bool contains(std::uint64_t pair) const { return slots_[place_of(pair)] == pair; }
  void insert(std::uint64_t pair);

 private:
  static constexpr std::size_t kFirstSlots = 256;  // a power of two, as the most are

  // Of the pair, or of the free slot for it.
  [[nodiscard]] std::size_t place_of(std::uint64_t pair) const;

  const std::size_t max_slots_;
  std::vector<std::uint64_t> slots_;  // at most three quarters full
  std::size_t used_ = 0;
};

class Proof {
 public:
  // `max_slots`: a power of two; fewer are for tests.
  explicit Proof(Budget& budget, std::size_t max_slots = NodePairSet::kMaxSlots)
      : budget_(budget), apart_(max_slots) {}

  using Pair = std::pair<std::size_t, std::size_t>;  // indices, the lower one first

  // Every pair of functions that can hold together, in order of the second, then of the first.
  // Throws StepLimit, Stopped.
  std::vector<Pair> pairs_that_meet(const std::vector<DiagramNodes>& functions);

  // Some activation under which both hold; no literal of it can be left out. For two that are known
  // to meet: whatever is left of the budget, since it takes no more than to find that out. Throws
  // Stopped.
  Literals meeting_point(const DiagramNodes& a, const DiagramNodes& b);

 private:
  bool meet(const DiagramNodes& a, const DiagramNodes& b);
  bool walk(const DiagramNodes& a, shm::Word at_a, const DiagramNodes& b, shm::Word at_b);

  Budget& budget_;
  NodePairSet apart_;  // known to exclude each other
  Literals path_;      // to where the last walk found that both hold
};

}  // namespace arbiter::rules
