// Reduced, ordered binary decision diagrams (Bryant 1986; paper, section III.A), made by BuDDy.
//
// BuDDy keeps one instance in global variables, ends the program on an error unless told otherwise,
// and reports an error by calling back in the middle of its work. Only diagram.cpp, and the
// operations of diagram_operation.cpp, include it: there its errors become exceptions, and its
// nodes and steps get bounds.
//
// Thread safety: a builder holds the one instance for as long as it lives; another thread that
// makes one waits. A builder and its diagrams are for one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "rules/prove/budget.hpp"
#include "rules/prove/diagram_operation.hpp"
#include "shm/decision_table.hpp"
#include "shm/limits.hpp"

namespace arbiter::rules {

// About four times what one connection may have in the end, since what lies between is often larger
// than the result; with their caches they take some 16 MiB. A prime number: BuDDy only makes tables
// of such sizes, and if sifting fills one that cannot grow to its limit for that reason alone, it
// writes behind the table's end.
inline constexpr int kMaxWorkingNodes = 262139;

// A Boolean function of the builder's variables. Two are the same function iff they are equal.
class Diagram {
 public:
  Diagram() = default;  // false
  Diagram(const Diagram& other);
  Diagram(Diagram&& other) noexcept;
  Diagram& operator=(Diagram other) noexcept;
  ~Diagram();

  [[nodiscard]] bool is_false() const { return node_ == 0; }
  [[nodiscard]] bool is_true() const { return node_ == 1; }
  [[nodiscard]] int id() const { return node_; }  // the same for the same function

  friend bool operator==(const Diagram& a, const Diagram& b) { return a.node_ == b.node_; }

 private:
  friend class DiagramBuilder;
  Diagram(int node, std::uint32_t instance);

  int node_ = 0;
  std::uint32_t instance_ = 0;  // of BuDDy; a diagram that outlives its instance is inert
};

// A diagram taken out of BuDDy. Nodes are sorted by level: node 0 is the root, successors lie
// behind their node, or are shm::table::kFalse / kTrue.
struct DiagramNodes {
  struct Node {
    int level;  // place of the variable in the order
    int variable;
    shm::Word low, high;
  };
  shm::Word root = shm::table::kFalse;  // 0, kFalse or kTrue
  std::vector<Node> nodes;
};

enum class Connective { kAnd, kOr, kXor, kImplies, kIff, kAndNot };

class DiagramBuilder {
 public:
  static constexpr int kVariables = static_cast<int>(shm::kMaxSourcesPerPort);
  static constexpr int kMaxVariables = 4 * kVariables;  // for what is asked of several ports

  // Without sifting, diagrams that outgrow the table are given up at once: where the question is
  // not worth the second that each attempt to find a better order may take.
  explicit DiagramBuilder(Budget& budget, int variables = kVariables, bool sifts = true);
  // With a budget of its own.
  explicit DiagramBuilder(int variables = kVariables, bool sifts = true);
  ~DiagramBuilder();
  DiagramBuilder(const DiagramBuilder&) = delete;
  DiagramBuilder& operator=(const DiagramBuilder&) = delete;

  // All of these throw StepLimit and Stopped, after which all diagrams are as they were; and
  // DiagramLimit where a function outgrows the node table, or one operation kMaxSteps: then the
  // builder is as new, and all its diagrams are lost.
  [[nodiscard]] Diagram combine(Connective connective, const Diagram& a, const Diagram& b);
  [[nodiscard]] Diagram negate(const Diagram& a);
  [[nodiscard]] Diagram when(const Diagram& a, int variable);  // `variable` taken as true
  [[nodiscard]] Diagram when_not(const Diagram& a, int variable);
  // Whether in some state the function is true, and would not be if only the variable were not what
  // `value` says.
  [[nodiscard]] bool needs(const Diagram& function, int variable, bool value);
  // `high` where the variable is true, `low` where it is not.
  [[nodiscard]] Diagram choose(int variable, const Diagram& high, const Diagram& low);
  // Looks for an order of the variables that makes all living diagrams together smaller.
  void sift();

  [[nodiscard]] Diagram constant(bool value);
  [[nodiscard]] Diagram variable(int variable);
  // Of a diagram that is not constant.
  [[nodiscard]] int top_variable(const Diagram& a) const;
  [[nodiscard]] Diagram low(const Diagram& a);
  [[nodiscard]] Diagram high(const Diagram& a);

  // Of all operations so far.
  [[nodiscard]] std::size_t steps() const { return budget_.spent(); }

  [[nodiscard]] int level_of(int variable) const;
  [[nodiscard]] std::size_t node_count(const Diagram& a) const;
  [[nodiscard]] DiagramNodes nodes(const Diagram& a);

  // Back to the order 0, 1, 2, … if it was changed. All diagrams are lost then.
  void restore_order();

 private:
  // Of one operation, for the sake of the memory that its results take up until it ends.
  static constexpr std::size_t kMaxSteps = std::size_t{4} * kMaxWorkingNodes;

  template <class Operation>
  Diagram operate(Operation operation);
  Diagram restrict(const Diagram& a, int variable, bool value);
  void begin_again();
  void start();
  void stop();
  [[noreturn]] void start_anew(int error);
  static int node_of(const Diagram& a);
  static Diagram keep(int node);

  std::unique_lock<std::mutex> only_one_;
  std::optional<Budget> own_budget_;
  Budget& budget_;
  const int variables_;
  const bool sifts_;
  bool order_changed_ = false;
  DiagramOperation operation_;
  int sifts_left_ = 0;                    // by itself
  int max_nodes_ = 0;                     // before it sifts
  std::vector<shm::Word> index_of_node_;  // scratch of nodes(), by BuDDy's node
};

}  // namespace arbiter::rules
