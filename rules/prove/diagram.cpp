#include "rules/prove/diagram.hpp"

#include <bdd.h>
// Of the two interfaces, that of C is used: BDD is an int.
#undef bdd_ithvar
#undef bdd_nithvar

#include <algorithm>
#include <csetjmp>
#include <new>
#include <string>
#include <utility>

namespace arbiter::rules {
namespace {

constexpr bool is_prime(int n) {
  for (int divisor = 2; divisor * divisor <= n; ++divisor) {
    if (n % divisor == 0) return false;
  }
  return true;
}
static_assert(is_prime(kMaxWorkingNodes));
static_assert(kMaxWorkingNodes > 2 * static_cast<int>(shm::kMaxNodesPerConnection));

constexpr int kFirstNodes = 20000;
constexpr int kNodesPerCacheEntry = 4;
// Sifting starts by itself when there are so many nodes, and again when they have doubled since;
// each time takes as long as a few hundred thousand nodes may.
constexpr int kNodesToSift = 80000;
constexpr int kAutomaticSifts = 2;
// What BuDDy does by itself takes about as long as these would.
constexpr std::uint64_t kStepsOfStart = 2000;
constexpr std::uint64_t kStepsOfCollection = kMaxWorkingNodes / 16;

std::mutex one_instance;
std::uint32_t current_instance = 0;

std::jmp_buf recovery;
int failure = 0;

// BuDDy calls this in the midst of a recursion, and carries on with wrong results if it returns.
// The jump skips frames of C only (see attempt()), and happens before BuDDy stores anything wrong.
extern "C" void leave_buddy(int code) {
  failure = code;
  std::longjmp(recovery, 1);
}

// Bit 2 * left + right.
int truth_table_of(Connective connective) {
  switch (connective) {
    case Connective::kAnd:
      return 0b1000;
    case Connective::kOr:
      return 0b1110;
    case Connective::kXor:
      return 0b0110;
    case Connective::kImplies:
      return 0b1011;
    case Connective::kIff:
      return 0b1001;
    case Connective::kAndNot:
      return 0b0100;
  }
  return 0;
}

// Since BuDDy was started; sifting makes most of those that it moves.
std::uint64_t nodes_made() {
  bddStat statistics{};
  bdd_stats(&statistics);
  return static_cast<std::uint64_t>(statistics.produced);
}

// The result of `operation`, or the error that BuDDy called back with. Neither this frame nor
// `operation` may hold an object with a destructor: leave_buddy() jumps over them.
template <class Operation>
int attempt(Operation operation) {
  if (setjmp(recovery) != 0) return failure;
  return operation();
}

[[noreturn]] void fail(int code) {
  if (code == BDD_NODENUM || code == DiagramOperation::kTooManyNodes) {
    throw DiagramLimit("more than " + std::to_string(kMaxWorkingNodes) + " nodes");
  }
  if (code == DiagramOperation::kTooManySteps) throw DiagramLimit("too many steps at once");
  if (code == BDD_MEMORY) throw std::bad_alloc();
  throw std::logic_error(std::string("decision diagrams: ") + bdd_errstring(code));
}

}  // namespace

Diagram::Diagram(int node, std::uint32_t instance) : node_(bdd_addref(node)), instance_(instance) {}

Diagram::Diagram(const Diagram& other) : node_(other.node_), instance_(other.instance_) {
  if (instance_ == current_instance) bdd_addref(node_);
}

Diagram::Diagram(Diagram&& other) noexcept
    : node_(std::exchange(other.node_, 0)), instance_(other.instance_) {}

Diagram& Diagram::operator=(Diagram other) noexcept {
  std::swap(node_, other.node_);
  std::swap(instance_, other.instance_);
  return *this;
}

Diagram::~Diagram() {
  if (instance_ == current_instance) bdd_delref(node_);
}

DiagramBuilder::DiagramBuilder(Budget& budget, int variables, bool sifts)
    : only_one_(one_instance), budget_(budget), variables_(variables), sifts_(sifts) {
  start();
}

DiagramBuilder::DiagramBuilder(int variables, bool sifts)
    : only_one_(one_instance),
      own_budget_(std::in_place),
      budget_(*own_budget_),
      variables_(variables),
      sifts_(sifts) {
  start();
}

DiagramBuilder::~DiagramBuilder() { stop(); }

void DiagramBuilder::start() {
  budget_.note(kStepsOfStart);  // first, since it throws where the run is to stop
  ++current_instance;
  order_changed_ = false;
  sifts_left_ = sifts_ ? kAutomaticSifts : 0;
  max_nodes_ = kNodesToSift;
  if (const int error = bdd_init(kFirstNodes, kFirstNodes / kNodesPerCacheEntry); error < 0) {
    fail(error);
  }
  bdd_error_hook(leave_buddy);
  bdd_gbc_hook(nullptr);  // the default one writes to standard error
  bdd_reorder_hook(nullptr);
  const int variables = variables_;
  const auto set_up = [variables] {
    bdd_setmaxnodenum(kMaxWorkingNodes);
    bdd_setcacheratio(kNodesPerCacheEntry);
    bdd_setvarnum(variables);
    bdd_varblockall();  // sifting moves blocks: each variable is one
    return bdd_autoreorder(BDD_REORDER_NONE);
  };
  if (const int error = attempt(set_up); error < 0) {
    stop();
    fail(error);
  }
}

void DiagramBuilder::stop() {
  ++current_instance;
  operation_.end(true);
  if (bdd_isrunning() != 0) bdd_done();
}

void DiagramBuilder::restore_order() {
  if (!order_changed_) return;
  stop();
  start();
}

// After an error the instance may be half-way through something, so nothing in it is worth keeping.
void DiagramBuilder::start_anew(int error) {
  stop();
  start();
  fail(error);
}

template <class Operation>
Diagram DiagramBuilder::operate(Operation operation) {
  for (;;) {
    budget_.spend(1);
    DiagramOperation* const steps = &operation_;
    const std::uint64_t left = budget_.left();
    const DiagramOperation::Bounds bounds{
        static_cast<std::size_t>(std::min<std::uint64_t>(kMaxSteps, left)),
        sifts_left_ == 0 ? kMaxWorkingNodes : max_nodes_};
    const int result = attempt([=] { return operation(*steps, bounds); });
    if (result >= 0) {
      Diagram kept = keep(result);
      budget_.note(operation_.end(false));
      return kept;
    }
    if (result == DiagramOperation::kTooManySteps && left < kMaxSteps) {
      budget_.spend(operation_.end(false) + 1);  // throws: it would take more
    }
    if (result != DiagramOperation::kTooManyNodes || sifts_left_ == 0) start_anew(result);
    begin_again();
  }
}

// Unless most nodes were garbage, with a better order of the variables.
void DiagramBuilder::begin_again() {
  bdd_gbc();
  const bool is_in_use = bdd_getnodenum() >= max_nodes_ / 5 * 4;
  budget_.note(operation_.end(false) + kStepsOfCollection);
  if (!is_in_use) return;
  --sifts_left_;
  sift();
  max_nodes_ = std::max(max_nodes_, 2 * bdd_getnodenum());
}

int DiagramBuilder::node_of(const Diagram& a) {
  if (a.node_ > 1 && a.instance_ != current_instance) {
    throw std::logic_error("a diagram is used after its instance of BuDDy has gone");
  }
  return a.node_;
}

Diagram DiagramBuilder::keep(int node) { return {node, current_instance}; }

Diagram DiagramBuilder::combine(Connective connective, const Diagram& a, const Diagram& b) {
  const int left = node_of(a), right = node_of(b), truth_table = truth_table_of(connective);
  return operate([=](DiagramOperation& operation, const DiagramOperation::Bounds& bounds) {
    return operation.apply(left, right, truth_table, bounds);
  });
}

Diagram DiagramBuilder::negate(const Diagram& a) {
  return combine(Connective::kXor, a, constant(true));
}

Diagram DiagramBuilder::restrict(const Diagram& a, int variable, bool value) {
  const int node = node_of(a);
  return operate([=](DiagramOperation& operation, const DiagramOperation::Bounds& bounds) {
    return operation.restrict(node, variable, value, bounds);
  });
}

Diagram DiagramBuilder::when(const Diagram& a, int variable) { return restrict(a, variable, true); }

Diagram DiagramBuilder::when_not(const Diagram& a, int variable) {
  return restrict(a, variable, false);
}

bool DiagramBuilder::needs(const Diagram& function, int variable, bool value) {
  const Diagram is = value ? when(function, variable) : when_not(function, variable);
  const Diagram is_not = value ? when_not(function, variable) : when(function, variable);
  return !combine(Connective::kAndNot, is, is_not).is_false();
}

Diagram DiagramBuilder::choose(int variable, const Diagram& high, const Diagram& low) {
  const Diagram condition = this->variable(variable);
  return combine(Connective::kOr, combine(Connective::kAnd, condition, high),
                 combine(Connective::kAndNot, low, condition));
}

void DiagramBuilder::sift() {
  order_changed_ = true;
  const std::uint64_t before = nodes_made();
  const int result = attempt([] {
    bdd_reorder(BDD_REORDER_SIFT);
    return 0;
  });
  const std::uint64_t made = nodes_made() - before;
  if (result < 0) start_anew(result);
  budget_.note(made);
}

Diagram DiagramBuilder::constant(bool value) { return keep(value ? 1 : 0); }
Diagram DiagramBuilder::variable(int variable) { return keep(bdd_ithvar(variable)); }
int DiagramBuilder::top_variable(const Diagram& a) const { return bdd_var(node_of(a)); }
Diagram DiagramBuilder::low(const Diagram& a) { return keep(bdd_low(node_of(a))); }
Diagram DiagramBuilder::high(const Diagram& a) { return keep(bdd_high(node_of(a))); }
int DiagramBuilder::level_of(int variable) const { return bdd_var2level(variable); }

std::size_t DiagramBuilder::node_count(const Diagram& a) const {
  return static_cast<std::size_t>(bdd_nodecount(node_of(a)));
}

DiagramNodes DiagramBuilder::nodes(const Diagram& a) {
  DiagramNodes result;
  if (a.is_false() || a.is_true()) {
    result.root = a.is_true() ? shm::table::kTrue : shm::table::kFalse;
    return result;
  }
  // By depth, low before high, so that equal functions give equal lists whatever BuDDy numbered.
  index_of_node_.resize(static_cast<std::size_t>(bdd_getallocnum()), shm::kNone);
  std::vector<std::pair<int, int>> found;  // level, node
  std::vector<int> pending{node_of(a)};
  while (!pending.empty()) {
    const int node = pending.back();
    pending.pop_back();
    if (node < 2 || index_of_node_[static_cast<std::size_t>(node)] != shm::kNone) continue;
    index_of_node_[static_cast<std::size_t>(node)] = 0;
    found.emplace_back(bdd_var2level(bdd_var(node)), node);
    pending.push_back(bdd_high(node));
    pending.push_back(bdd_low(node));
  }
  const auto is_above = [](const auto& left, const auto& right) {
    return left.first < right.first;
  };
  // As those of conjunctions are already, which most are.
  if (!std::is_sorted(found.begin(), found.end(), is_above)) {
    std::stable_sort(found.begin(), found.end(), is_above);
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    index_of_node_[static_cast<std::size_t>(found[i].second)] = static_cast<shm::Word>(i);
  }
  const auto successor = [&](int node) {
    if (node < 2) return node == 1 ? shm::table::kTrue : shm::table::kFalse;
    return index_of_node_[static_cast<std::size_t>(node)];
  };
  result.root = 0;
  result.nodes.reserve(found.size());
  for (const auto& [level, node] : found) {
    result.nodes.push_back(
        {level, bdd_var(node), successor(bdd_low(node)), successor(bdd_high(node))});
  }
  for (const auto& [level, node] : found) {
    index_of_node_[static_cast<std::size_t>(node)] = shm::kNone;
  }
  budget_.note(found.size());
  return result;
}

}  // namespace arbiter::rules
