#include "rules/prove/compile.hpp"

#include <algorithm>
#include <set>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "rules/prove/compile_port.hpp"
#include "rules/prove/contradiction.hpp"
#include "rules/prove/flatten.hpp"
#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

class ModelCompiler {
 public:
  ModelCompiler(const RuleSet& rules, Diagnostics& diagnostics, Budget& budget,
                std::size_t max_precedence_nodes)
      : rules_(rules),
        diagnostics_(diagnostics),
        context_(rules, budget, attempt_, max_precedence_nodes) {}

  CompiledModel compile();

 private:
  [[nodiscard]] std::vector<std::string> all_sources() const;
  void gather_parts();
  void compile_arbitrated_ports();
  void compile_port_at(std::size_t index);
  void hand_over();
  void assume_running(const PortRules& port);
  void report_out_of_steps(const PortRules& port);
  void add_unarbitrated_ports();
  void report_never_running();
  void report_unreachable_children();
  void check_limits();
  void limit_exceeded(const Location& where, std::string_view what, std::string_view limit,
                      std::size_t value);

  const RuleSet& rules_;
  Diagnostics& diagnostics_;
  Diagnostics attempt_;  // what is found at a port, until it is known whether that counts
  CompileContext context_;
  CompiledModel model_;
  std::map<std::string, std::vector<BehaviourPart>> parts_;             // by port
  std::map<std::string, std::vector<std::string>> unselected_sources_;  // by port
  std::vector<bool> may_run_;                                           // by behaviour
};

CompiledModel ModelCompiler::compile() {
  model_.timeout = rules_.timeout;
  model_.timeouts = rules_.timeouts;
  model_.sources = all_sources();
  model_.texts = rules_.texts;
  const bool is_whole = !diagnostics_.has_errors();
  gather_parts();
  compile_arbitrated_ports();
  add_unarbitrated_ports();
  report_never_running();
  report_unreachable_children();
  if (is_whole) check_limits();  // reading has told what it found of them
  return std::move(model_);
}

std::vector<std::string> ModelCompiler::all_sources() const {
  std::set<std::string> sources(rules_.sources.begin(), rules_.sources.end());
  for (const auto& connection : rules_.other_connections) sources.insert(connection.source);
  return {sources.begin(), sources.end()};
}

void ModelCompiler::gather_parts() {
  for (const auto& connection : rules_.other_connections) {
    unselected_sources_[connection.port].push_back(connection.source);
  }
  may_run_.resize(rules_.behaviours.size());
  for (std::size_t i = 0; i < rules_.behaviours.size(); ++i) {
    for (const auto& [port, rule] : rules_.behaviours[i].rules) {
      parts_[port].push_back({i, &rule});
    }
  }
}

void ModelCompiler::compile_arbitrated_ports() {
  std::vector<std::size_t> judged;  // ports
  for (std::size_t i = 0; i < rules_.ports.size(); ++i) {
    if (rules_.ports[i].is_doubtful) {
      assume_running(rules_.ports[i]);
    } else {
      judged.push_back(i);
    }
  }
  const auto name = [&](std::size_t i) { return rules_.ports[judged[i]].port; };
  const auto compile_it = [&](std::size_t i) { compile_port_at(judged[i]); };
  for (const std::size_t open :
       share_out(context_.budget, "proving", judged.size(), name, compile_it)) {
    report_out_of_steps(rules_.ports[judged[open]]);
  }
}

void ModelCompiler::compile_port_at(std::size_t index) {
  const auto& port = rules_.ports[index];
  const auto& parts = parts_[port.port];
  auto unselected = unselected_sources_[port.port];
  attempt_ = {};
  auto result = compile_port(context_, {port, unselected, parts});
  hand_over();
  if (!result) return assume_running(port);
  for (const std::size_t behaviour : result->running) may_run_[behaviour] = true;
  for (auto& source : unselected) {
    CompiledRule rule;
    rule.source = std::move(source);
    rule.kind = shm::table::kNever;
    result->port.rules.push_back(std::move(rule));
  }
  model_.ports.push_back(std::move(result->port));
}

void ModelCompiler::hand_over() {
  diagnostics_.add(std::move(attempt_));
  attempt_ = {};
}

// Nobody knows.
void ModelCompiler::assume_running(const PortRules& port) {
  for (const auto& part : parts_[port.port]) may_run_[part.behaviour] = true;
}

void ModelCompiler::report_out_of_steps(const PortRules& port) {
  assume_running(port);
  diagnostics_.error("limit-exceeded", port.where,
                     "whether only one can win at " + port.port +
                         " was neither proved nor refuted: it takes more steps than there are for "
                         "it; write simpler conditions there, or allow more steps with --effort",
                     {.ports = {port.port}});
}

void ModelCompiler::add_unarbitrated_ports() {
  std::set<std::string_view> arbitrated;
  for (const auto& port : rules_.ports) arbitrated.insert(port.port);
  for (auto& [name, sources] : unselected_sources_) {
    if (arbitrated.contains(name)) continue;
    CompiledPort port{name, false, {}, {}};
    for (auto& source : sources) {
      CompiledRule rule;
      rule.source = std::move(source);
      rule.kind = shm::table::kAlways;
      port.rules.push_back(std::move(rule));
    }
    model_.ports.push_back(std::move(port));
  }
  std::sort(model_.ports.begin(), model_.ports.end(),
            [](const auto& left, const auto& right) { return left.port < right.port; });
}

void ModelCompiler::report_never_running() {
  constexpr int kMaxExplained = 100;  // each takes some diagrams
  int explained = 0;
  // What only explains leaves the steps to what is asked later.
  const Budget::Part part(context_.budget, context_.budget.left() / 10);
  for (std::size_t i = 0; i < rules_.behaviours.size(); ++i) {
    const auto& behaviour = rules_.behaviours[i];
    if (may_run_[i] || behaviour.rules.empty()) continue;
    std::string reasons;
    if (explained < kMaxExplained) {
      ++explained;
      reasons = why_it_never_runs(context_.builder, behaviour, rules_);
    }
    diagnostics_.warning(
        "never-runs", behaviour.where,
        "no activity of the sources lets the behaviour " + quote(behaviour.name) +
            " run: none of its connections can ever be selected for it" + reasons +
            "; look for a condition or an inhibition, its own or inherited, that contradicts "
            "another one",
        {.behaviour = behaviour.name});
  }
}

// A meta-behaviour can be reached if one of its children can.
void ModelCompiler::report_unreachable_children() {
  std::unordered_map<std::string_view, bool> reached;
  for (std::size_t i = 0; i < rules_.behaviours.size(); ++i) {
    reached.emplace(rules_.behaviours[i].name, may_run_[i] || rules_.behaviours[i].rules.empty());
  }
  std::unordered_map<std::string_view, const MetaBehaviour*> metas;
  std::unordered_map<std::string_view, std::size_t> missing;  // children of which nothing is known
  std::unordered_map<std::string_view, std::string_view> parents;
  std::vector<const MetaBehaviour*> known;
  for (const auto& meta : rules_.meta_behaviours) metas.emplace(meta.name, &meta);
  for (const auto& meta : rules_.meta_behaviours) {
    for (const auto& child : meta.children) {
      parents.emplace(child, meta.name);
      if (metas.contains(child)) ++missing[meta.name];
    }
    if (missing[meta.name] == 0) known.push_back(&meta);
  }
  // From the innermost outwards; whatever their depth, without recursion.
  for (std::size_t i = 0; i < known.size(); ++i) {
    const auto is_reached = [&](const std::string& child) { return reached[child]; };
    const auto& children = known[i]->children;
    reached[known[i]->name] =
        children.empty() || std::any_of(children.begin(), children.end(), is_reached);
    const auto parent = parents.find(known[i]->name);
    if (parent == parents.end() || --missing[parent->second] > 0) continue;
    known.push_back(metas.at(parent->second));
  }
  for (const auto& meta : rules_.meta_behaviours) {
    std::vector<std::string> lost;
    for (const auto& child : meta.children) {
      if (!reached[child]) lost.push_back(quote(child));
    }
    if (lost.empty()) continue;
    diagnostics_.warning(
        "unreachable-children", meta.where,
        std::to_string(lost.size()) + " of the " + std::to_string(meta.children.size()) +
            (meta.children.size() == 1 ? " child" : " children") + " of " + quote(meta.name) +
            " can never run: " + enumerate(lost) +
            "; see what is said of each, or look at the conditions and inhibitions of " +
            quote(meta.name),
        {.behaviour = meta.name});
  }
}

void ModelCompiler::limit_exceeded(const Location& where, std::string_view what,
                                   std::string_view limit, std::size_t value) {
  diagnostics_.error("limit-exceeded", where,
                     std::string(what) + " than " + std::string(limit) + " (" +
                         std::to_string(value) + ") allows; split the model");
}

// What is true of every table that is made of the model, whatever ids its sources and ports get.
void ModelCompiler::check_limits() {
  const Location start{rules_.ports.empty() ? std::string() : rules_.ports[0].where.file, 1, 1};
  if (model_.sources.size() > shm::kMaxSources) {
    limit_exceeded(start, "more sources", "kMaxSources", shm::kMaxSources);
  }
  if (model_.ports.size() > shm::kMaxInputPorts) {
    limit_exceeded(start, "more input ports", "kMaxInputPorts", shm::kMaxInputPorts);
  }
  std::size_t connections = 0;
  std::map<std::string_view, std::size_t> destinations;
  for (const auto& port : model_.ports) {
    connections += port.rules.size();
    if (port.rules.size() > shm::kMaxSourcesPerPort) {
      limit_exceeded(start, "more connections to " + port.port, "kMaxSourcesPerPort",
                     shm::kMaxSourcesPerPort);
    }
    for (const auto& rule : port.rules) {
      if (++destinations[rule.source] == shm::kMaxDestinations + 1) {
        limit_exceeded(start, "more connections from " + rule.source, "kMaxDestinations",
                       shm::kMaxDestinations);
      }
    }
  }
  if (connections > shm::kMaxConnections) {
    limit_exceeded(start, "more connections", "kMaxConnections", shm::kMaxConnections);
  }
  if (largest_table(model_) > shm::kMaxTableWords) {
    limit_exceeded(start, "more words in the decision table", "kMaxTableWords",
                   shm::kMaxTableWords);
  }
}

}  // namespace

CompiledModel compile(const RuleSet& rules, Diagnostics& diagnostics, Budget& budget,
                      std::size_t max_precedence_nodes) {
  const Budget::Part part(budget, budget.left() / 5 * 4);
  return ModelCompiler(rules, diagnostics, budget, max_precedence_nodes).compile();
}

CompiledModel compile(const RuleSet& rules, Diagnostics& diagnostics,
                      std::size_t max_precedence_nodes) {
  Budget budget;
  return compile(rules, diagnostics, budget, max_precedence_nodes);
}

}  // namespace arbiter::rules
