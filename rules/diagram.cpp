#include "rules/diagram.hpp"

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
// Sifting starts by itself when the table has outgrown its first size, and again when it has
// doubled since; each time takes as long as a few hundred thousand nodes may.
constexpr int kAutomaticSifts = 2;

std::mutex one_instance;
std::uint32_t current_instance = 0;
bool was_reordered = false;

std::jmp_buf recovery;
int failure = 0;

// BuDDy calls this in the midst of a recursion, and carries on with wrong results if it returns.
// The jump skips frames of C only (see attempt()), and happens before BuDDy stores anything wrong.
extern "C" void leave_buddy(int code) {
  failure = code;
  std::longjmp(recovery, 1);
}

extern "C" void note_reordering(int) { was_reordered = true; }

int operator_of(Connective connective) {
  switch (connective) {
    case Connective::kAnd:
      return bddop_and;
    case Connective::kOr:
      return bddop_or;
    case Connective::kXor:
      return bddop_xor;
    case Connective::kImplies:
      return bddop_imp;
    case Connective::kIff:
      return bddop_biimp;
    case Connective::kAndNot:
      return bddop_diff;
  }
  return bddop_and;
}

// The result of `operation`, or the error that BuDDy called back with. Neither this frame nor
// `operation` may hold an object with a destructor: leave_buddy() jumps over them.
template <class Operation>
int attempt(Operation operation) {
  if (setjmp(recovery) != 0) return failure;
  return operation();
}

[[noreturn]] void fail(int code) {
  if (code == BDD_NODENUM) {
    throw DiagramLimit("more than " + std::to_string(kMaxWorkingNodes) + " nodes");
  }
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

DiagramBuilder::DiagramBuilder(int variables, bool sifts)
    : only_one_(one_instance), variables_(variables), sifts_(sifts) {
  start();
}

DiagramBuilder::~DiagramBuilder() { stop(); }

void DiagramBuilder::start() {
  ++current_instance;
  was_reordered = false;
  order_changed_ = false;
  if (const int error = bdd_init(kFirstNodes, kFirstNodes / kNodesPerCacheEntry); error < 0) {
    fail(error);
  }
  bdd_error_hook(leave_buddy);
  bdd_gbc_hook(nullptr);  // the default one writes to standard error
  bdd_reorder_hook(note_reordering);
  const int variables = variables_;
  const int method = sifts_ ? BDD_REORDER_SIFT : BDD_REORDER_NONE;
  const auto set_up = [variables, method] {
    bdd_setmaxnodenum(kMaxWorkingNodes);
    bdd_setcacheratio(kNodesPerCacheEntry);
    bdd_setvarnum(variables);
    bdd_varblockall();  // sifting moves blocks: each variable is one
    return bdd_autoreorder_times(method, kAutomaticSifts);
  };
  if (const int error = attempt(set_up); error < 0) {
    stop();
    fail(error);
  }
}

void DiagramBuilder::stop() {
  ++current_instance;
  if (bdd_isrunning() != 0) bdd_done();
}

void DiagramBuilder::restore_order() {
  if (!order_changed_ && !was_reordered) return;
  stop();
  start();
}

// After an error the instance may be half-way through a reordering, so none is worth keeping.
template <class Operation>
int DiagramBuilder::run(Operation operation) {
  const int result = attempt(operation);
  if (result < 0) {
    stop();
    start();
    fail(result);
  }
  return result;
}

int DiagramBuilder::node_of(const Diagram& a) {
  if (a.node_ > 1 && a.instance_ != current_instance) {
    throw std::logic_error("a diagram is used after its instance of BuDDy has gone");
  }
  return a.node_;
}

Diagram DiagramBuilder::keep(int node) { return {node, current_instance}; }

Diagram DiagramBuilder::combine(Connective connective, const Diagram& a, const Diagram& b) {
  const int left = node_of(a), right = node_of(b), op = operator_of(connective);
  return keep(run([=] { return bdd_apply(left, right, op); }));
}

Diagram DiagramBuilder::negate(const Diagram& a) {
  const int node = node_of(a);
  return keep(run([=] { return bdd_not(node); }));
}

Diagram DiagramBuilder::when(const Diagram& a, int variable) {
  const int node = node_of(a);
  return keep(run([=] { return bdd_restrict(node, bdd_ithvar(variable)); }));
}

Diagram DiagramBuilder::when_not(const Diagram& a, int variable) {
  const int node = node_of(a);
  return keep(run([=] { return bdd_restrict(node, bdd_nithvar(variable)); }));
}

Diagram DiagramBuilder::choose(int variable, const Diagram& high, const Diagram& low) {
  const int then = node_of(high), otherwise = node_of(low);
  return keep(run([=] { return bdd_ite(bdd_ithvar(variable), then, otherwise); }));
}

void DiagramBuilder::sift() {
  order_changed_ = true;
  run([] {
    bdd_reorder(BDD_REORDER_SIFT);
    return 0;
  });
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
  std::vector<int> found;
  std::vector<int> pending{node_of(a)};
  while (!pending.empty()) {
    const int node = pending.back();
    pending.pop_back();
    if (node < 2 || index_of_node_[static_cast<std::size_t>(node)] != shm::kNone) continue;
    index_of_node_[static_cast<std::size_t>(node)] = 0;
    found.push_back(node);
    pending.push_back(bdd_high(node));
    pending.push_back(bdd_low(node));
  }
  const auto level = [](int node) { return bdd_var2level(bdd_var(node)); };
  std::stable_sort(found.begin(), found.end(),
                   [&](int left, int right) { return level(left) < level(right); });
  for (std::size_t i = 0; i < found.size(); ++i) {
    index_of_node_[static_cast<std::size_t>(found[i])] = static_cast<shm::Word>(i);
  }
  const auto successor = [&](int node) {
    if (node < 2) return node == 1 ? shm::table::kTrue : shm::table::kFalse;
    return index_of_node_[static_cast<std::size_t>(node)];
  };
  result.root = 0;
  result.nodes.reserve(found.size());
  for (const int node : found) {
    result.nodes.push_back(
        {level(node), bdd_var(node), successor(bdd_low(node)), successor(bdd_high(node))});
  }
  for (const int node : found) index_of_node_[static_cast<std::size_t>(node)] = shm::kNone;
  return result;
}

}  // namespace arbiter::rules
