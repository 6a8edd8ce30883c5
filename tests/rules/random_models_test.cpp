// Random models of behaviours, meta-behaviours, conditions and inhibitions, as files of XML,
// through the whole chain, against an evaluator that knows only how a rule is defined: it extracts
// nothing, but looks at the behaviours anew for each activation.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>

#include "rules/compile.hpp"
#include "rules/explain.hpp"
#include "rules/load.hpp"
#include "tests/rules/rules_by_hand.hpp"
#include "tests/support/live_table.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

const std::vector<std::string> kSources = {"/a:o", "/b:o", "/c:o", "/d:o", "/e:o", "/f:o"};
const std::vector<std::string> kPorts = {"/p:i", "/q:i"};

constexpr int kNone = -1;

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

using Active = std::set<std::string>;

std::string name_of(int element) { return "Element " + std::to_string(element); }

// Fully parenthesised, so that precedences do not matter here; they have tests of their own.
std::string written(const rules::Expression& e) {
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
  explicit Generator(unsigned seed) : random_(seed) {}

  RandomModel model() {
    RandomModel model;
    const int behaviours = 2 + pick(4);
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
    for (int count = 1 + pick(2); count > 0; --count) configs.emplace(pick(kPorts), pick(kSources));
    element.configs.assign(configs.begin(), configs.end());
  }

  ExpressionPtr condition(int depth) {
    if (depth == 0 || pick(4) == 0) {
      return pick(2) == 0 ? active(pick(kSources)) : inactive(pick(kSources));
    }
    static constexpr Operator kOperators[] = {Operator::kAnd, Operator::kOr, Operator::kXor,
                                              Operator::kImplies, Operator::kIff};
    auto left = condition(depth - 1);
    return binary(kOperators[pick(5)], std::move(left), condition(depth - 1));
  }

  std::mt19937 random_;
};

std::string to_xml(const RandomModel& model, bool first_wins) {
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
  if (first_wins) {
    for (const auto& port : kPorts) {
      if (xml.find(port) != std::string::npos) {
        xml += "<arbiter at=\"" + port + "\" conflict=\"first\"/>\n";
      }
    }
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

 private:
  const Element& element(int index) const {
    return model_.elements[static_cast<std::size_t>(index)];
  }

  bool may_run_at(int behaviour, const std::string& port, const Active& active) const {
    return obstacles(behaviour, port, active).empty();
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

// How many pairs of connections can win together, by trying all activations.
std::size_t count_conflicts(const NaiveEvaluator& naive) {
  std::set<std::vector<std::string>> pairs;
  for (const auto& port : kPorts) {
    for (const auto& active : subsets(kSources)) {
      const auto selected = naive.selected(port, active);
      for (std::size_t j = 1; j < selected.size(); ++j) {
        for (std::size_t i = 0; i < j; ++i) pairs.insert({port, selected[i], selected[j]});
      }
    }
  }
  return pairs.size();
}

class RandomModels : public testing::TestWithParam<bool> {
 protected:
  void check(unsigned seed);

  int decided_ = 0, refused_ = 0;
};

void RandomModels::check(unsigned seed) {
  const bool first_wins = GetParam();
  const RandomModel random = Generator(seed).model();
  const std::string xml = to_xml(random, first_wins);
  SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + xml);
  const TemporaryDirectory directory;
  rules::Diagnostics diagnostics;
  const auto set = rules::load({{directory.write("model.xml", xml)}, {}}, diagnostics);
  ASSERT_FALSE(diagnostics.has_errors()) << diagnostics.items().back().message;
  const auto model = rules::compile(set, diagnostics);
  const NaiveEvaluator naive(random);
  const std::size_t expected_conflicts = first_wins ? 0 : count_conflicts(naive);
  const auto found = std::count_if(diagnostics.items().begin(), diagnostics.items().end(),
                                   [](const auto& item) { return item.code == "both-can-win"; });
  EXPECT_EQ(static_cast<std::size_t>(found), expected_conflicts);
  EXPECT_EQ(diagnostics.has_errors(), expected_conflicts > 0);
  ++(expected_conflicts > 0 ? refused_ : decided_);
  if (expected_conflicts > 0) return;
  LiveTable live(model);
  for (const auto& active : subsets(kSources)) {
    live.activate_only(active);
    for (const auto& port : kPorts) {
      if (naive.sources_at(port).empty()) continue;
      auto expected = naive.selected(port, active);
      if (!expected.empty()) expected.resize(1);
      ASSERT_EQ(live.winners(port), expected) << port << ' ' << testing::PrintToString(active);
      for (const auto& source : naive.sources_at(port)) {
        auto after = active;
        after.insert(source);
        const auto selected = naive.selected(port, after);
        EXPECT_EQ(live.delivers(source, port), !selected.empty() && selected.front() == source);
      }
    }
  }
}

// Explanations against the definition: what is said to keep a connection out does so by itself,
// whatever all others do, and nothing that does is left out.
class Explanations {
 public:
  Explanations(const RandomModel& random, const rules::RuleSet& set)
      : naive_(random), explainer_(set) {}

  void check(const std::string& port) {
    for (const auto& active : activations_) {
      SCOPED_TRACE(port + ' ' + testing::PrintToString(active));
      const auto explained = explainer_.explain(
          port, [&](const std::string& source) { return active.contains(source); });
      const auto selected = naive_.selected(port, active);
      EXPECT_EQ(explained.winner.value_or(""), selected.empty() ? "" : selected.front());
      std::vector<std::string> sources;
      for (const auto& connection : explained.connections) {
        sources.push_back(connection.source);
        EXPECT_EQ(connection.wins, explained.winner == connection.source);
        check_reason(port, connection, active);
        for (const auto& part : connection.parts) check_part(port, part, active);
      }
      EXPECT_EQ(sources, naive_.sources_at(port));
    }
  }

  int reasons() const { return reasons_; }

 private:
  static bool agrees(const std::vector<rules::Literal>& literals, const Active& active) {
    return std::all_of(literals.begin(), literals.end(), [&](const rules::Literal& literal) {
      return active.contains(literal.source) == literal.active;
    });
  }

  void check_reason(const std::string& port, const rules::ConnectionExplanation& connection,
                    const Active& active) {
    const auto reason = connection.reason();
    ASSERT_EQ(reason.has_value(), !connection.wins);
    if (!reason) return;
    ++reasons_;
    EXPECT_TRUE(agrees(*reason, active));
    for (const auto& other : activations_) {
      if (!agrees(*reason, other)) continue;
      const auto selected = naive_.selected(port, other);
      EXPECT_TRUE(selected.empty() || selected.front() != connection.source)
          << "with " << testing::PrintToString(other);
    }
  }

  void check_part(const std::string& port, const rules::Part& part, const Active& active) {
    ASSERT_TRUE(part.behaviour);
    const int behaviour = std::stoi(part.behaviour->name.substr(std::strlen("Element ")));
    std::multiset<std::string> told;
    for (const auto& cause : part.causes) {
      ASSERT_TRUE(cause.of);
      const bool inhibits = cause.kind == rules::Cause::Kind::kInhibited;
      const std::string obstacle = inhibits ? cause.inhibitor->name + " inhibits " + cause.of->name
                                            : "condition of " + cause.of->name;
      told.insert(obstacle);
      EXPECT_TRUE(agrees(cause.because, active));
      for (const auto& other : activations_) {
        if (!agrees(cause.because, other)) continue;
        EXPECT_EQ(naive_.obstacles(behaviour, port, other).count(obstacle) > 0, true) << obstacle;
      }
      if (!inhibits) continue;
      // Once all that it names are inactive, the inhibition is over.
      auto after = active;
      for (const auto& literal : cause.because) after.erase(literal.source);
      for (const auto& source : cause.also) after.erase(source);
      EXPECT_EQ(naive_.obstacles(behaviour, port, after).count(obstacle), 0u) << obstacle;
    }
    EXPECT_EQ(told, naive_.obstacles(behaviour, port, active));
  }

  const NaiveEvaluator naive_;
  const rules::Explainer explainer_;
  const std::vector<Active> activations_ = subsets(kSources);
  int reasons_ = 0;
};

TEST_P(RandomModels, AreExplainedAsTheDefinitionOfARuleSays) {
  int reasons = 0;
  for (unsigned seed = 0; seed < 15; ++seed) {
    const RandomModel random = Generator(seed).model();
    const std::string xml = to_xml(random, GetParam());
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + xml);
    const TemporaryDirectory directory;
    rules::Diagnostics diagnostics;
    const auto set = rules::load({{directory.write("model.xml", xml)}, {}}, diagnostics,
                                rules::Keep::kProvenance);
    ASSERT_FALSE(diagnostics.has_errors());
    Explanations explanations(random, set);
    for (const auto& port : set.ports) explanations.check(port.port);
    reasons += explanations.reasons();
    if (HasFailure()) return;
  }
  EXPECT_GT(reasons, 300);
}

TEST_P(RandomModels, DecideAsTheDefinitionOfARuleSays) {
  for (unsigned seed = 0; seed < 300; ++seed) check(seed);
  EXPECT_GT(decided_, 60);
  EXPECT_EQ(refused_ > 60, !GetParam());
}

INSTANTIATE_TEST_SUITE_P(, RandomModels, testing::Bool(), [](const auto& param_info) {
  return param_info.param ? "WithConflictFirst" : "WithProof";
});

}  // namespace
}  // namespace arbiter::test
