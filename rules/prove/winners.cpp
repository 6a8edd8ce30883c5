#include "rules/prove/winners.hpp"

#include <algorithm>
#include <queue>
#include <set>

#include "rules/prove/witness.hpp"
#include "rules/text/names.hpp"
#include "shm/decision_table.hpp"

namespace arbiter::rules {
namespace {

// The order of the variables in a port's diagrams, as far as these show it: each list of reads
// follows it. Of what they leave open, the first mentioned comes first.
std::vector<std::string> order_of(const CompiledPort& port) {
  std::vector<std::string> names;
  std::unordered_map<std::string, std::size_t> index;
  const auto index_of = [&](const std::string& name) {
    const auto [found, is_new] = index.try_emplace(name, names.size());
    if (is_new) names.push_back(name);
    return found->second;
  };
  std::vector<std::set<std::size_t>> after;
  const auto make_room = [&] { after.resize(names.size()); };
  for (const auto& rule : port.rules) {
    index_of(rule.source);
    for (const auto& read : rule.reads) index_of(read);
  }
  for (const auto& read : port.reads) index_of(read);
  make_room();
  std::vector<std::size_t> before(names.size());
  for (const auto& rule : port.rules) {
    for (std::size_t i = 1; i < rule.reads.size(); ++i) {
      const std::size_t from = index.at(rule.reads[i - 1]), to = index.at(rule.reads[i]);
      if (after[from].insert(to).second) ++before[to];
    }
  }
  std::priority_queue<std::size_t, std::vector<std::size_t>, std::greater<>> ready;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (before[i] == 0) ready.push(i);
  }
  std::vector<std::string> result;
  while (!ready.empty()) {
    const std::size_t next = ready.top();
    ready.pop();
    result.push_back(names[next]);
    for (const std::size_t follower : after[next]) {
      if (--before[follower] == 0) ready.push(follower);
    }
  }
  return result;
}

}  // namespace

void SourceOrder::add(const CompiledPort& port) {
  std::unordered_map<std::string, std::size_t> known;
  for (std::size_t i = 0; i < names_.size(); ++i) known.emplace(names_[i], i);
  // What is new goes behind the one that it follows in its port.
  std::vector<std::vector<std::string>> behind(names_.size() + 1);
  std::size_t last = 0;
  for (auto& name : order_of(port)) {
    const auto found = known.find(name);
    if (found != known.end()) {
      last = found->second + 1;
    } else {
      behind[last].push_back(std::move(name));
    }
  }
  std::vector<std::string> merged = std::move(behind[0]);
  for (std::size_t i = 0; i < names_.size(); ++i) {
    merged.push_back(std::move(names_[i]));
    for (auto& name : behind[i + 1]) merged.push_back(std::move(name));
  }
  names_ = std::move(merged);
}

void SourceOrder::add(const std::string& source) {
  if (std::find(names_.begin(), names_.end(), source) == names_.end()) names_.push_back(source);
}

Winners::Winners(Budget& budget, const SourceOrder& order, bool sifts)
    : names_(order.names()),
      budget_(budget),
      builder_(budget,
               std::clamp(static_cast<int>(names_.size()), 1, DiagramBuilder::kMaxVariables),
               sifts) {
  if (names_.size() > static_cast<std::size_t>(DiagramBuilder::kMaxVariables)) {
    throw DiagramLimit("more than " + std::to_string(DiagramBuilder::kMaxVariables) + " sources");
  }
  for (std::size_t i = 0; i < names_.size(); ++i) {
    variables_.emplace(names_[i], static_cast<int>(i));
  }
}

Diagram Winners::winner(const CompiledPort& port, const CompiledRule& rule) {
  Diagram result = holds(rule);
  if (!port.in_order) return result;
  for (const CompiledRule* earlier = port.rules.data(); earlier != &rule; ++earlier) {
    if (result.is_false()) break;
    result = combine(Connective::kAndNot, result, holds(*earlier));
  }
  return result;
}

Diagram Winners::holds(const CompiledRule& rule) {
  using shm::table::kTrue;
  Diagram own = active(rule.source);
  if (rule.kind == shm::table::kNever) return constant(false);
  if (rule.kind == shm::table::kAlways) return own;
  Diagram condition;
  if (rule.kind == shm::table::kConjunction) {
    condition = constant(true);
    for (std::size_t i = rule.reads.size(); i-- > 0;) {
      const Diagram read = active(rule.reads[i]);
      condition = rule.expected[i] ? combine(Connective::kAnd, read, condition)
                                   : combine(Connective::kAndNot, condition, read);
    }
  } else {
    std::vector<Diagram> built(rule.nodes.size());
    const auto of = [&](shm::Word node) {
      return node < shm::table::kFalse ? built[node] : constant(node == kTrue);
    };
    for (std::size_t i = rule.nodes.size(); i-- > 0;) {
      const auto& node = rule.nodes[i];
      built[i] =
          builder_.choose(variables_.at(rule.reads[node.position]), of(node.high), of(node.low));
    }
    condition = built[0];
  }
  return combine(Connective::kAnd, own, condition);
}

Diagram Winners::given(const Diagram& function, const std::string& source, bool active) {
  const int variable = variables_.at(source);
  return active ? builder_.when(function, variable) : builder_.when_not(function, variable);
}

Witness Winners::witness(const Diagram& function, const Diagram& reached) {
  ShortestImplicant shortest(builder_);
  std::optional<std::vector<VariableLiteral>> literals;
  try {
    const Budget::Part search(budget_, budget_.left() / 2);
    literals = shortest.find_literals(function, reached);
  } catch (const StepLimit&) {  // another one is told, even where no step is left
  }
  Witness witness;
  witness.is_shortest = literals.has_value();
  if (!literals) {
    const Budget::Overdraft overdraft(budget_);
    literals = lean_implicant(builder_, function, reached);
  }
  for (const VariableLiteral& literal : *literals) {
    (literal.active ? witness.active : witness.inactive)
        .push_back(names_[static_cast<std::size_t>(literal.variable)]);
  }
  std::sort(witness.active.begin(), witness.active.end());
  std::sort(witness.inactive.begin(), witness.inactive.end());
  return witness;
}

const CompiledRule* find_winner(const CompiledPort& port, const std::set<std::string>& active) {
  const auto holds = [&](const CompiledRule& rule) {
    if (rule.kind == shm::table::kNever || !active.contains(rule.source)) return false;
    for (std::size_t i = 0; i < rule.expected.size(); ++i) {
      if (active.contains(rule.reads[i]) != rule.expected[i]) return false;
    }
    shm::Word at = rule.nodes.empty() ? shm::table::kTrue : 0;
    while (at < shm::table::kFalse) {
      const auto& node = rule.nodes[at];
      at = active.contains(rule.reads[node.position]) ? node.high : node.low;
    }
    return at == shm::table::kTrue;
  };
  const auto found = std::find_if(port.rules.begin(), port.rules.end(), holds);
  return found == port.rules.end() ? nullptr : &*found;
}

}  // namespace arbiter::rules
