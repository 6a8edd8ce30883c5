#include "rules/prove/compile_port.hpp"

#include <algorithm>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "rules/prove/in_order.hpp"
#include "rules/prove/rule_builder.hpp"
#include "rules/prove/winners.hpp"
#include "rules/text/names.hpp"
#include "rules/text/xml.hpp"

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
  void build_plain_rules();
  void multiply_precedence_out();
  bool subtract_earlier_rules();
  bool compile_rules(CompiledPort& result);
  void find_who_can_win(CompiledPort& result);
  StateSearch::Answer search(const std::vector<StateSearch::Proposition>& wanted);
  [[nodiscard]] bool can_win_as(std::size_t rule, const ConnectionRule& part);
  std::vector<std::size_t> behaviours_that_run();
  void report_never_selected();
  void report_conflicts();
  Witness witness_of(const Proof::Pair& pair);
  [[nodiscard]] std::string advice_on_inhibition(const std::string& first,
                                                 const std::string& second) const;
  void report_conflict(const Proof::Pair& pair);
  void report_in_order(const InOrder& order);
  void report_outgrown(const ConnectionRule* rule);

  CompileContext& context_;
  const PortTask& task_;
  const PortRules& port_;
  RuleBuilder rules_;
  std::set<std::string> written_;             // in conditions
  const ConnectionRule* building_ = nullptr;  // to name it when it outgrows the node table
  std::vector<Diagram> plain_;                // the rules as they are, with the own source
  // The same, less what earlier ones win; but where the port is decided in order, as they are.
  std::vector<Diagram> functions_;
  bool in_order_ = false;
  std::vector<bool> can_win_;  // by rule; where that is not found out, it is taken as so
  // Of a port that is decided in order: what its diagrams would be too large for.
  std::optional<StateSearch> search_;
  StateSearch::Port winners_;
  std::vector<DiagramNodes> nodes_;  // of functions_
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
            ") sources are connected to " + port_.port + " or read by its rules; use fewer there",
        {.ports = {port_.port}});
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
  build_plain_rules();
  functions_ = plain_;
  if (port_.first_wins) multiply_precedence_out();
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

void PortCompiler::build_plain_rules() {
  const auto build = [&] {
    plain_.clear();
    rules_.forget_parts();
    for (const auto& rule : port_.rules) {
      building_ = &rule;
      plain_.push_back(rules_.rule(rule));
    }
  };
  try {
    build();
  } catch (const StepLimit&) {
    throw;
  } catch (const DiagramLimit&) {
    rules_.join_as_written();
    build();
  }
}

// conflict="first": a rule holds only where none before it does. Where to say so in each rule would
// make too much of them, they stay as they are, and are decided in order.
void PortCompiler::multiply_precedence_out() {
  bool lost = false;
  try {
    const Budget::Part part(context_.budget,
                            std::min(kMaxPrecedenceSteps, context_.budget.left() / 2));
    in_order_ = !subtract_earlier_rules();
  } catch (const StepLimit&) {
    in_order_ = true;
  } catch (const DiagramLimit&) {
    in_order_ = lost = true;
  }
  if (lost) build_plain_rules();
  if (in_order_) functions_ = plain_;
}

// What the earlier ones win together is kept as one function while it is small; it may explode, and
// then each is taken away by itself. False: a bound was met.
bool PortCompiler::subtract_earlier_rules() {
  auto& builder = context_.builder;
  const auto is_within = [&](const Diagram& function, std::size_t nodes) {
    return function.is_false() || function.is_true() || builder.node_count(function) <= nodes;
  };
  Diagram won = builder.constant(false);
  bool has_union = true;
  for (std::size_t i = 0; i < functions_.size(); ++i) {
    building_ = &port_.rules[i];
    if (has_union) {
      functions_[i] = builder.combine(Connective::kAndNot, functions_[i], won);
      has_union = is_within(won, kMaxUnionNodes) && is_within(plain_[i], kMaxUnionNodes);
      if (has_union) won = builder.combine(Connective::kOr, won, plain_[i]);
    } else {
      for (std::size_t j = 0; j < i; ++j) {
        functions_[i] = builder.combine(Connective::kAndNot, functions_[i], plain_[j]);
      }
    }
    // Of a rule that is large by itself, order would save nothing.
    const std::size_t most =
        std::max(context_.max_precedence_nodes, 2 * builder.node_count(plain_[i]));
    if (!is_within(functions_[i], most)) return false;
  }
  return true;
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
  result.in_order = in_order_;
  find_who_can_win(result);
  if (in_order_) {
    const InOrder order = put_in_order(result);
    written_.insert(order.reads.begin(), order.reads.end());
    report_in_order(order);
  }
  result.reads.assign(written_.begin(), written_.end());
  return fits;
}

void PortCompiler::find_who_can_win(CompiledPort& result) {
  for (const auto& function : functions_) can_win_.push_back(!function.is_false());
  if (!in_order_) return;
  search_.emplace(StateSearch::steps_within(context_.budget.left() / 2));
  winners_ = search_->winners(result);
  for (std::size_t i = 0; i < result.rules.size(); ++i) {
    CompiledRule& rule = result.rules[i];
    // Most rules hold where nothing is active but what they ask for.
    std::set<std::string> asked{rule.source};
    for (std::size_t read = 0; read < rule.expected.size(); ++read) {
      if (rule.expected[read]) asked.insert(rule.reads[read]);
    }
    if (!can_win_[i] || find_winner(result, asked) == &rule) continue;
    can_win_[i] = search({winners_.wins[i]}) != StateSearch::Answer::kNo;
    if (can_win_[i]) continue;
    // Where it holds, an earlier one does too, so those behind it do not miss it.
    rule.kind = shm::table::kNever;
    rule.reads.clear();
    rule.expected.clear();
    rule.nodes.clear();
  }
}

StateSearch::Answer PortCompiler::search(const std::vector<StateSearch::Proposition>& wanted) {
  const int steps = search_->steps_left();
  const auto answer = search_->find(wanted);
  context_.budget.note(StateSearch::budget_of(steps - search_->steps_left()));
  return answer;
}

// Whether the rule can win by what one behaviour contributes to it.
bool PortCompiler::can_win_as(std::size_t rule, const ConnectionRule& part) {
  if (!can_win_[rule] || part.condition == port_.rules[rule].condition) return can_win_[rule];
  const Diagram condition = rules_.rule(part);
  auto& builder = context_.builder;
  if (!in_order_) return !builder.combine(Connective::kAnd, functions_[rule], condition).is_false();
  const Diagram rest = builder.when(condition, rules_.variable(part.source));
  const auto holds =
      search_->holds(to_compiled_rule(part.source, builder.nodes(rest), rules_.names()));
  return search({winners_.wins[rule], holds}) != StateSearch::Answer::kNo;
}

std::vector<std::size_t> PortCompiler::behaviours_that_run() {
  std::unordered_map<std::string, std::size_t> index;
  for (std::size_t i = 0; i < port_.rules.size(); ++i) index.emplace(port_.rules[i].source, i);
  std::vector<std::size_t> running;
  for (const auto& part : task_.parts) {
    const auto found = index.find(part.rule->source);
    if (found == index.end()) continue;
    building_ = part.rule;
    if (can_win_as(found->second, *part.rule)) running.push_back(part.behaviour);
  }
  building_ = nullptr;
  return running;
}

void PortCompiler::report_never_selected() {
  for (std::size_t i = 0; i < functions_.size(); ++i) {
    if (can_win_[i]) continue;
    const auto& rule = port_.rules[i];
    context_.diagnostics.warning(
        "never-selected", rule.where,
        rule.source + " can never win at " + port_.port +
            (plain_[i].is_false()
                 ? ": no activity of the sources satisfies its rule; look for a condition or an "
                   "inhibition that contradicts another one"
                 : ": whenever its rule holds, that of an earlier connection does, too, which "
                   "conflict=\"first\" prefers; move it up, or remove it"),
        {.ports = {port_.port}, .source = rule.source, .behaviour = rule.behaviour});
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
                                  "; correct the first ones",
                              {.ports = {port_.port}});
  }
}

// A shortest one, or where that takes too long, one of which no literal can be left out.
Witness PortCompiler::witness_of(const Proof::Pair& pair) {
  std::optional<Literals> literals;
  if (shortest_) {
    try {
      literals = shortest_->find(context_.builder.combine(Connective::kAnd, functions_[pair.first],
                                                          functions_[pair.second]));
    } catch (const DiagramLimit&) {
      shortest_.reset();  // the diagrams are gone; their nodes serve for those that follow, too
    }
  }
  Witness witness;
  witness.is_shortest = literals.has_value();
  if (!literals) literals = context_.proof.meeting_point(nodes_[pair.first], nodes_[pair.second]);
  for (std::size_t variable = 0; variable < rules_.names().size(); ++variable) {
    if (literals->active[variable]) witness.active.push_back(rules_.names()[variable]);
    if (literals->inactive[variable]) witness.inactive.push_back(rules_.names()[variable]);
  }
  std::sort(witness.active.begin(), witness.active.end());
  std::sort(witness.inactive.begin(), witness.inactive.end());
  return witness;
}

// "let one inhibit the other, ", as far as that would help.
std::string PortCompiler::advice_on_inhibition(const std::string& first,
                                               const std::string& second) const {
  std::vector<std::size_t> one, other;
  for (const BehaviourPart& part : task_.parts) {
    if (part.rule->source == first) one.push_back(part.behaviour);
    if (part.rule->source == second) other.push_back(part.behaviour);
  }
  const std::string advice = context_.advice.inhibition(one, other);
  return advice.empty() ? advice : advice + ", ";
}

void PortCompiler::report_conflict(const Proof::Pair& pair) {
  const auto& first = port_.rules[pair.first];
  const auto& second = port_.rules[pair.second];
  Witness witness = witness_of(pair);
  std::string message = second.source + " and " + first.source + " (" +
                        rules::describe(first.where) + ") can both win at " + port_.port +
                        " when " + describe(witness) + "; " +
                        advice_on_inhibition(first.source, second.source) +
                        "give one a condition that excludes the other, or let document order "
                        "decide with <arbiter at=\"" +
                        escape_xml(port_.port) + R"(" conflict="first"/>)";
  Subject about{.ports = {port_.port}, .source = second.source, .behaviour = second.behaviour};
  for (const auto* rule : {&first, &second}) about.winners.emplace_back(port_.port, rule->source);
  context_.diagnostics.error("both-can-win", second.where, std::move(message), std::move(about),
                             std::move(witness));
}

void PortCompiler::report_in_order(const InOrder& order) {
  context_.diagnostics.note(
      "decided-in-order", port_.where,
      "the rules at " + port_.port + " are tried one after the other, up to " +
          std::to_string(port_.rules.size()) + " of them, for each decision, which reads up to " +
          std::to_string(order.reads.size()) +
          " sources: one diagram for each, with those before it multiplied out, would be too "
          "large; the winners are the same, and docs/performance.md says what it costs");
}

void PortCompiler::report_outgrown(const ConnectionRule* rule) {
  context_.diagnostics.error(
      "limit-exceeded", rule != nullptr ? rule->where : port_.where,
      (rule != nullptr ? "the rule of " + rule->source : std::string("a rule")) + " at " +
          port_.port + " needs a decision diagram of more than kMaxNodesPerConnection (" +
          std::to_string(shm::kMaxNodesPerConnection) +
          ") nodes; write a simpler condition, or one that reads fewer sources",
      {.ports = {port_.port}, .source = rule != nullptr ? rule->source : std::string()});
}

}  // namespace

std::optional<PortResult> compile_port(CompileContext& context, const PortTask& task) {
  return PortCompiler(context, task).compile();
}

}  // namespace arbiter::rules
