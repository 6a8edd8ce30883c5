// Operations on BuDDy's nodes that end after a bounded number of steps.
//
// BuDDy has such operations too. But they remember what they have computed in a cache in which one
// result displaces another, so that a function with few nodes can take them exponential time, and
// they cannot be interrupted. Here every pair of nodes is combined once (Bryant 1986), and steps
// are counted.
//
// Thread safety: none, as BuDDy.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rules/prove/pair_table.hpp"

namespace arbiter::rules {

// What is known of pairs of nodes, and of the steps that were taken to know it. The results are
// referenced, so that BuDDy keeps them.
class NodePairs {
 public:
  NodePairs() : entries_(kFirstEntries) {}

  // Null if it is not known.
  [[nodiscard]] const int* find(int left, int right) const;
  void insert(int left, int right, int result);
  [[nodiscard]] std::size_t size() const { return used_.size(); }

  // With the results' references, or, if BuDDy's instance has gone, without.
  void clear(bool instance_has_gone);

 private:
  struct Entry {
    std::uint64_t pair = kNoPair;
    int result = 0;
  };
  static constexpr std::size_t kFirstEntries = 1024;  // a power of two
  static constexpr std::size_t kKeptEntries = 65536;  // after a large operation

  [[nodiscard]] std::size_t place_of(std::uint64_t pair) const;
  void grow();

  std::vector<Entry> entries_;  // at most half full
  std::vector<std::size_t> used_;
};

class DiagramOperation {
 public:
  struct Bounds {
    std::size_t steps;
    int nodes;  // in BuDDy's table, with those that are no longer used
  };
  // In place of a node.
  static constexpr int kTooManySteps = -1001;
  static constexpr int kTooManyNodes = -1002;

  // The order of the variables must not change while one of these runs. BuDDy's error hook may
  // leave them by a jump: no frame has a destructor. Whatever comes back, end() follows.
  // The operator's truth table has the outcome as bit 2 * left + right.
  int apply(int left, int right, int truth_table, const Bounds& bounds);
  int restrict(int node, int variable, bool value, const Bounds& bounds);

  // The number of steps that were taken since the last end().
  std::size_t end(bool instance_has_gone);

 private:
  int apply(int left, int right);
  int restrict(int node);
  int make(int variable, int low, int high);

  NodePairs pairs_;
  Bounds bounds_{};
  int truth_table_ = 0;  // of the operator
  int level_ = 0;        // of the variable that is restricted
  bool value_ = false;
};

}  // namespace arbiter::rules
