// Random models of behaviours, meta-behaviours, conditions and inhibitions, as files of XML, and an
// evaluator that knows only how a rule is defined: it extracts nothing, but looks at the behaviours
// anew for each activation.
#pragma once

#include <algorithm>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/rules/rules_by_hand.hpp"

namespace arbiter::test {

// What a random model is made of.
struct Vocabulary {
  std::vector<std::string> sources = {"/a:o", "/b:o", "/c:o", "/d:o", "/e:o", "/f:o"};
  std::vector<std::string> ports = {"/p:i", "/q:i"};
  int min_behaviours = 2, max_behaviours = 5;
};

inline constexpr int kNone = -1;

struct Element {  // a behaviour, or a meta-behaviour if it has children
  int parent = kNone;
  std::vector<int> children;
  std::vector<std::pair<std::string, std::string>> configs;  // {port, source}
  std::vector<ExpressionPtr> conditions;
  std::vector<int> inhibits;
};

struct RandomModel {
  std::vector<Element> elements;
  std::vector<int> document;  // the order in which the elements are written
};

inline std::string name_of(int element) { return "Element " + std::to_string(element); }

// Fully parenthesised, so that precedences do not matter here; they have tests of their own.
inline std::string written(const rules::Expression& e) {
  const auto operand = [&](std::size_t i) { return written(*e.operands[i]); };
  switch (e.op) {
    case Operator::kSource:
      return e.name;
    case Operator::kNot:
      return "not (" + operand(0) + ")";
    case Operator::kAnd:
      return "(" + operand(0) + ") and (" + operand(1) + ")";
    case Operator::kOr:
      return "(" + operand(0) + ") or (" + operand(1) + ")";
    case Operator::kXor:
      return "(" + operand(0) + ") xor (" + operand(1) + ")";
    case Operator::kImplies:
      return "(" + operand(0) + ") implies (" + operand(1) + ")";
    case Operator::kIff:
      return "(" + operand(0) + ") iff (" + operand(1) + ")";
    default:
      return e.op == Operator::kTrue ? "true" : "false";
  }
}

class Generator {
 public:
  explicit Generator(unsigned seed, Vocabulary words = {})
      : words_(std::move(words)), random_(seed) {}

  RandomModel model() {
    RandomModel model;
    const int behaviours =
        words_.min_behaviours + pick(words_.max_behaviours - words_.min_behaviours + 1);
    model.elements.resize(static_cast<std::size_t>(behaviours));
    for (int metas = pick(3); metas > 0; --metas) group(model);
    for (std::size_t i = 0; i < model.elements.size(); ++i) {
      Element& element = model.elements[i];
      if (element.children.empty()) configure(element);
      if (pick(3) == 0) element.conditions.push_back(condition(2));
      if (pick(9) == 0) element.conditions.push_back(condition(1));
      for (std::size_t other = 0; other < model.elements.size(); ++other) {
        if (other == i || model.elements[other].parent != element.parent) continue;
        if (pick(3) == 0) element.inhibits.push_back(static_cast<int>(other));
      }
      model.document.push_back(static_cast<int>(i));
    }
    std::shuffle(model.document.begin(), model.document.end(), random_);
    return model;
  }

 private:
  int pick(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }
  const std::string& pick(const std::vector<std::string>& from) {
    return from[static_cast<std::size_t>(pick(static_cast<int>(from.size())))];
  }

  // Puts some of the elements that have no parent yet under a new one.
  void group(RandomModel& model) {
    std::vector<int> children;
    for (std::size_t i = 0; i < model.elements.size(); ++i) {
      if (model.elements[i].parent == kNone && pick(2) == 0)
        children.push_back(static_cast<int>(i));
    }
    if (children.empty()) return;
    const int meta = static_cast<int>(model.elements.size());
    for (const int child : children) model.elements[static_cast<std::size_t>(child)].parent = meta;
    model.elements.emplace_back().children = children;
  }

  void configure(Element& element) {
    std::set<std::pair<std::string, std::string>> configs;
    for (int count = 1 + pick(2); count > 0; --count)
      configs.emplace(pick(words_.ports), pick(words_.sources));
    element.configs.assign(configs.begin(), configs.end());
  }

  ExpressionPtr condition(int depth) {
    if (depth == 0 || pick(4) == 0) {
      return pick(2) == 0 ? active(pick(words_.sources)) : inactive(pick(words_.sources));
    }
    static constexpr Operator kOperators[] = {Operator::kAnd, Operator::kOr, Operator::kXor,
                                              Operator::kImplies, Operator::kIff};
    auto left = condition(depth - 1);
    return binary(kOperators[pick(5)], std::move(left), condition(depth - 1));
  }

  Vocabulary words_;
  std::mt19937 random_;
};

inline std::string to_xml(const RandomModel& model, const std::set<std::string>& first_wins_at) {
  std::string xml = "<behaviors>\n";
  for (const int index : model.document) {
    const Element& element = model.elements[static_cast<std::size_t>(index)];
    const std::string tag = element.children.empty() ? "behavior" : "meta_behavior";
    xml += "<" + tag + " name=\"" + name_of(index) + "\">";
    for (const int child : element.children) xml += "<behavior>" + name_of(child) + "</behavior>";
    for (const auto& [port, source] : element.configs) {
      xml += "<config at=\"" + port + "\">" + source + "</config>";
    }
    for (const auto& condition : element.conditions) {
      xml += "<condition>" + written(*condition) + "</condition>";
    }
    for (const int other : element.inhibits) {
      xml += "<inhibition>" + name_of(other) + "</inhibition>";
    }
    xml += "</" + tag + ">\n";
  }
  for (const auto& port : first_wins_at) {
    if (xml.find("at=\"" + port) == std::string::npos) continue;
    xml += "<arbiter at=\"" + port + "\" conflict=\"first\"/>\n";
  }
  return xml + "</behaviors>\n";
}

class NaiveEvaluator {
 public:
  explicit NaiveEvaluator(const RandomModel& model) : model_(model) {}

  // Sources whose connection to the port is selected, in document order of the connections.
  std::vector<std::string> selected(const std::string& port, const Active& active) const {
    std::vector<std::string> result;
    for (const auto& source : sources_at(port)) {
      if (!active.contains(source)) continue;
      for (std::size_t i = 0; i < model_.elements.size(); ++i) {
        const auto& configs = model_.elements[i].configs;
        const bool configures =
            std::find(configs.begin(), configs.end(), std::pair(port, source)) != configs.end();
        if (!configures || !may_run_at(static_cast<int>(i), port, active)) continue;
        result.push_back(source);
        break;
      }
    }
    return result;
  }

  std::optional<std::string> winner(const std::string& port, const Active& active) const {
    const auto all = selected(port, active);
    return all.empty() ? std::nullopt : std::optional(all.front());
  }

  std::vector<std::string> sources_at(const std::string& port) const {
    std::vector<std::string> sources;
    for (const int index : model_.document) {
      for (const auto& [at, source] : element(index).configs) {
        if (at != port || std::find(sources.begin(), sources.end(), source) != sources.end()) {
          continue;
        }
        sources.push_back(source);
      }
    }
    return sources;
  }

  // What keeps a behaviour from running at a port, in a line each.
  std::multiset<std::string> obstacles(int behaviour, const std::string& port,
                                       const Active& active) const {
    std::multiset<std::string> result;
    for (int i = behaviour; i != kNone; i = element(i).parent) {
      for (const auto& condition : element(i).conditions) {
        if (!holds(*condition, active)) result.insert("condition of " + name_of(i));
      }
      for (std::size_t x = 0; x < model_.elements.size(); ++x) {
        const auto& named = model_.elements[x].inhibits;
        if (std::find(named.begin(), named.end(), i) == named.end()) continue;
        if (!is_active_at(static_cast<int>(x), port, active)) continue;
        result.insert(name_of(static_cast<int>(x)) + " inhibits " + name_of(i));
      }
    }
    return result;
  }

  bool may_run_at(int behaviour, const std::string& port, const Active& active) const {
    return obstacles(behaviour, port, active).empty();
  }

 private:
  const Element& element(int index) const {
    return model_.elements[static_cast<std::size_t>(index)];
  }

  // Whether an inhibitor silences others at the port: by its sources there, if it has any.
  bool is_active_at(int inhibitor, const std::string& port, const Active& active) const {
    std::set<std::string> at_port, anywhere;
    collect_sources(inhibitor, port, at_port, anywhere);
    const auto& sources = at_port.empty() ? anywhere : at_port;
    return std::any_of(sources.begin(), sources.end(),
                       [&](const auto& source) { return active.contains(source); });
  }

  void collect_sources(int index, const std::string& port, std::set<std::string>& at_port,
                       std::set<std::string>& anywhere) const {
    for (const auto& [at, source] : element(index).configs) {
      anywhere.insert(source);
      if (at == port) at_port.insert(source);
    }
    for (const int child : element(index).children) {
      collect_sources(child, port, at_port, anywhere);
    }
  }

  const RandomModel& model_;
};

// Whether the witness speaks of this activation.
inline bool agrees(const Active& now, const rules::Witness& witness) {
  const auto is_active = [&](const auto& source) { return now.contains(source); };
  return std::all_of(witness.active.begin(), witness.active.end(), is_active) &&
         std::none_of(witness.inactive.begin(), witness.inactive.end(), is_active);
}

}  // namespace arbiter::test
