#include "rules/compile_port.hpp"

#include <algorithm>
#include <utility>

#include "rules/names.hpp"

namespace arbiter::rules {
namespace {

// Smaller diagrams are quick enough as they are; sifting takes a while, too.
constexpr std::size_t kNodesWorthSifting = 1000;
// That sifting takes about: without them, the diagrams stay as they are.
constexpr std::size_t kStepsToSiftNode = 24;
// The union of the rules so far is kept for as long as it is this small.
constexpr std::size_t kMaxUnionNodes = 2000;
// Pairs reported for one port; more would not help to mend it.
constexpr std::size_t kMaxReportedPairs = 16;
std::string describe(const Witness& witness) {
  std::string text = enumerate(witness.active);
  text += witness.active.size() == 1 ? " is active" : " are active";
  if (!witness.inactive.empty()) {
    text += " while " + enumerate(witness.inactive);
    text += witness.inactive.size() == 1 ? " is not" : " are not";
  }
  return text;
}

class PortCompiler {
 public:
  PortCompiler(CompileContext& context, const PortTask& task)
      : context_(context), task_(task), port_(task.port), rules_(context.builder) {}

  std::optional<PortResult> compile();

 private:
  bool mention_sources();
  void build_rules();
  void subtract_earlier_rules();
  bool compile_rules(CompiledPort& result);
  std::vector<std::size_t> behaviours_that_run();
  void report_never_selected();
  void report_conflicts();
  Witness shortest_witness(const Proof::Pair& pair);
  void report_conflict(const Proof::Pair& pair);
  void report_outgrown(const ConnectionRule* rule);

  CompileContext& context_;
  const PortTask& task_;
  const PortRules& port_;
  RuleBuilder rules_;
  std::set<std::string> written_;             // in conditions
  const ConnectionRule* building_ = nullptr;  // to name it when it outgrows the node table
  std::vector<Diagram> plain_;                // the rules as they are, with the own source
  std::vector<Diagram> functions_;            // the same, less what earlier ones win
  std::vector<DiagramNodes> nodes_;           // of functions_
  std::optional<ShortestImplicant> shortest_;
};

std::optional<PortResult> PortCompiler::compile() {
  context_.builder.restore_order();
  if (!mention_sources()) return std::nullopt;
  PortResult result{{port_.port, true, {}, {}, port_.first_wins}, {}};
  try {
    build_rules();
    if (!compile_rules(result.port)) return std::nullopt;
    result.running = behaviours_that_run();
    report_never_selected();
  } catch (const StepLimit&) {
    throw;
  } catch (const DiagramLimit&) {
    report_outgrown(building_);
    return std::nullopt;
  }
  if (!port_.first_wins) report_conflicts();
  return result;
}

bool PortCompiler::mention_sources() {
  const auto has_room = [&](const Location& where) {
    if (rules_.names().size() <= shm::kMaxSourcesPerPort) return true;
    context_.diagnostics.error(
        "limit-exceeded", where,
        "more than kMaxSourcesPerPort (" + std::to_string(shm::kMaxSourcesPerPort) +
            ") sources are connected to " + port_.port + " or read by its rules; use fewer there");
    return false;
  };
  for (const auto& rule : port_.rules) {
    rules_.mention(rule.source);
    rules_.mention_all(*rule.condition, written_);
    if (!has_room(rule.where)) return false;
  }
  for (const auto& source : task_.unselected) rules_.mention(source);
  return has_room(port_.where);
}

void PortCompiler::build_rules() {
  for (const auto& rule : port_.rules) {
    building_ = &rule;
    plain_.push_back(rules_.rule(rule));
  }
  functions_ = plain_;
  if (port_.first_wins) subtract_earlier_rules();
  building_ = nullptr;
  std::size_t nodes = 0, largest = 0;
  for (const Diagram& function : functions_) {
    nodes += context_.builder.node_count(function);
    largest = std::max(largest, context_.builder.node_count(function));
  }
  if (largest > kNodesWorthSifting && context_.budget.left() > kStepsToSiftNode * nodes) {
    rules_.forget_parts();
    context_.builder.sift();
  }
}

// conflict="first": a rule holds only where none before it does. What the earlier ones win together
// is kept as one function while it is small; it may explode, and then each is taken away by itself.
void PortCompiler::subtract_earlier_rules() {
  auto& builder = context_.builder;
  const auto is_small = [&](const Diagram& function) {
    return function.is_false() || function.is_true() ||
           builder.node_count(function) <= kMaxUnionNodes;
  };
  Diagram won = builder.constant(false);
  bool has_union = true;
  for (std::size_t i = 0; i < functions_.size(); ++i) {
    building_ = &port_.rules[i];
    if (has_union) {
      functions_[i] = builder.combine(Connective::kAndNot, functions_[i], won);
      has_union = is_small(won) && is_small(plain_[i]);
      if (has_union) won = builder.combine(Connective::kOr, won, plain_[i]);
      continue;
    }
    for (std::size_t j = 0; j < i; ++j) {
      functions_[i] = builder.combine(Connective::kAndNot, functions_[i], plain_[j]);
    }
  }
}

bool PortCompiler::compile_rules(CompiledPort& result) {
  bool fits = true;
  for (std::size_t i = 0; i < functions_.size(); ++i) {
    building_ = &port_.rules[i];
    const auto& source = port_.rules[i].source;
    const Diagram rest = context_.builder.when(functions_[i], rules_.variable(source));
    auto rule = to_compiled_rule(source, context_.builder.nodes(rest), rules_.names());
    if (rule.nodes.size() > shm::kMaxNodesPerConnection) {
      report_outgrown(building_);
      fits = false;
    }
    // Only conflict="first" can make a rule depend on more than what is written in it.
    written_.insert(rule.reads.begin(), rule.reads.end());
    result.rules.push_back(std::move(rule));
    nodes_.push_back(context_.builder.nodes(functions_[i]));
  }
  building_ = nullptr;
  result.reads.assign(written_.begin(), written_.end());
  return fits;
}

std::vector<std::size_t> PortCompiler::behaviours_that_run() {
  std::unordered_map<std::string, std::size_t> index;
  for (std::size_t i = 0; i < port_.rules.size(); ++i) index.emplace(port_.rules[i].source, i);
  std::vector<std::size_t> running;
  for (const auto& part : task_.parts) {
    const auto found = index.find(part.rule->source);
    if (found == index.end()) continue;
    building_ = part.rule;
    Diagram function = functions_[found->second];
    if (part.rule->condition != port_.rules[found->second].condition) {
      function = context_.builder.combine(Connective::kAnd, function, rules_.rule(*part.rule));
    }
    if (!function.is_false()) running.push_back(part.behaviour);
  }
  building_ = nullptr;
  return running;
}

void PortCompiler::report_never_selected() {
  for (std::size_t i = 0; i < functions_.size(); ++i) {
    if (!functions_[i].is_false()) continue;
    const auto& rule = port_.rules[i];
    context_.diagnostics.warning(
        "never-selected", rule.where,
        rule.source + " can never win at " + port_.port +
            (plain_[i].is_false()
                 ? ": no activity of the sources satisfies its rule; look for a condition or an "
                   "inhibition that contradicts another one"
                 : ": whenever its rule holds, that of an earlier connection does, too, which "
                   "conflict=\"first\" prefers; move it up, or remove it"));
  }
}

void PortCompiler::report_conflicts() {
  const auto pairs = context_.proof.pairs_that_meet(nodes_);
  shortest_.emplace(context_.builder);
  // A conflict is told even where no step is left to look for a shorter witness of it.
  const Budget::Part search(context_.budget, context_.budget.left() / 2);
  for (std::size_t i = 0; i < std::min(pairs.size(), kMaxReportedPairs); ++i) {
    report_conflict(pairs[i]);
  }
  if (pairs.size() > kMaxReportedPairs) {
    context_.diagnostics.note("more-conflicts", port_.where,
                              std::to_string(pairs.size() - kMaxReportedPairs) +
                                  " more pairs of connections can both win at " + port_.port +
                                  "; mend those reported first");
  }
}

Witness PortCompiler::shortest_witness(const Proof::Pair& pair) {
  std::optional<Literals> literals;
  if (shortest_) {
    try {
      literals = shortest_->find(context_.builder.combine(Connective::kAnd, functions_[pair.first],
                                                          functions_[pair.second]));
    } catch (const DiagramLimit&) {
      shortest_.reset();  // the diagrams are gone; their nodes serve for those that follow, too
    }
  }
  if (!literals) literals = context_.proof.meeting_point(nodes_[pair.first], nodes_[pair.second]);
  Witness witness;
  for (std::size_t variable = 0; variable < rules_.names().size(); ++variable) {
    if (literals->active[variable]) witness.active.push_back(rules_.names()[variable]);
    if (literals->inactive[variable]) witness.inactive.push_back(rules_.names()[variable]);
  }
  std::sort(witness.active.begin(), witness.active.end());
  std::sort(witness.inactive.begin(), witness.inactive.end());
  return witness;
}

void PortCompiler::report_conflict(const Proof::Pair& pair) {
  const auto& first = port_.rules[pair.first];
  const auto& second = port_.rules[pair.second];
  Witness witness = shortest_witness(pair);
  std::string message = second.source + " and " + first.source + " (" +
                        rules::describe(first.where) + ") can both win at " + port_.port +
                        " when " + describe(witness) +
                        "; let one inhibit the other, give one a condition that excludes the "
                        "other, or let document order decide with <arbiter at=\"" +
                        port_.port + R"(" conflict="first"/>)";
  context_.diagnostics.error("both-can-win", second.where, std::move(message), std::move(witness));
}

void PortCompiler::report_outgrown(const ConnectionRule* rule) {
  context_.diagnostics.error(
      "limit-exceeded", rule != nullptr ? rule->where : port_.where,
      (rule != nullptr ? "the rule of " + rule->source : std::string("a rule")) + " at " +
          port_.port + " needs a decision diagram of more than kMaxNodesPerConnection (" +
          std::to_string(shm::kMaxNodesPerConnection) +
          ") nodes; write a simpler condition, or one that reads fewer sources");
}

}  // namespace

std::optional<PortResult> compile_port(CompileContext& context, const PortTask& task) {
  return PortCompiler(context, task).compile();
}

}  // namespace arbiter::rules
