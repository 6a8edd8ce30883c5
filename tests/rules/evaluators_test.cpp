// All that answer "who wins at this port?", held together by random models and the definition of a
// rule, over all activations: docs/decisions/evaluators.md says what each is for.
#include <gtest/gtest.h>

#include "rules/explain/explain.hpp"
#include "rules/explain/tenure.hpp"
#include "rules/model/load.hpp"
#include "rules/prove/compile.hpp"
#include "rules/prove/table_rules.hpp"
#include "rules/prove/winners.hpp"
#include "tests/rules/random_model.hpp"
#include "tests/support/live_table.hpp"
#include "tests/support/rounds.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

enum class Precedence { kProved, kInDiagrams, kInOrder };

// One model, once compiled.
class Evaluators {
 public:
  Evaluators(const rules::RuleSet& set, const rules::CompiledModel& model,
             const NaiveEvaluator& naive)
      : set_(set), model_(model), naive_(naive), live_(model) {}

  void check(const Active& active) {
    live_.activate_only(active);
    for (const auto& port : model_.ports) {
      SCOPED_TRACE(port.port + ' ' + testing::PrintToString(active));
      const auto winner = naive_.winner(port.port, active);
      check_decisions(port.port, active, winner);
      check_table(port.port, active, winner);
      check_before_the_table(port, active, winner);
    }
  }

 private:
  using Winner = std::optional<std::string>;

  // shm/decision.hpp against shm/port_picture.hpp.
  void check_decisions(const std::string& port, const Active& active, const Winner& winner) {
    EXPECT_EQ(live_.winner(port), winner) << "each rule decided by itself";
    const auto picture = live_.picture(port);
    const auto always = [](const shm::Rule&) { return true; };
    EXPECT_EQ(live_.name_of(picture.selection().rule.source), winner) << "in one picture";
    EXPECT_EQ(live_.name_of(picture.command(always).commander.source), winner) << "its commander";
    const shm::TableView table = live_.view();
    for (const auto& source : naive_.sources_at(port)) {
      Active after = active;
      after.insert(source);
      const auto rule = table.rule(table.find(live_.source_id(source), live_.port_id(port)));
      const bool delivers = naive_.winner(port, after) == source;
      EXPECT_EQ(live_.delivers(source, port), delivers) << "an arrival of " << source;
      EXPECT_EQ(picture.decide(rule) == shm::Verdict::kWins, delivers) << "in the picture";
    }
  }

  // What is read out of a table in memory otherwise.
  void check_table(const std::string& port, const Active& active, const Winner& winner) {
    const shm::TableView table = live_.view();
    const shm::PortId id = live_.port_id(port);
    const auto is_active = [&](shm::SourceId source) {
      const auto name = live_.name_of(source);
      return name && active.contains(*name);
    };
    EXPECT_EQ(live_.name_of(shm::selected_at(table, id, is_active).source), winner);
    const auto known = [&](shm::SourceId source) {
      return is_active(source) ? rules::Activation::kActive : rules::Activation::kInactive;
    };
    const auto range = table.connections_to(id);
    for (auto index = range.first; index != range.first + range.count; ++index) {
      const shm::Rule rule = table.rule(index);
      const bool holds = shm::holds(rule, is_active);
      EXPECT_EQ(holds, live_.name_of(rule.source) == winner);
      EXPECT_EQ(rules::evaluate(rule, known) == rules::Activation::kActive, holds) << "the past";
    }
    const auto read_back = rules::rules_of_table(
        table, id, port, [&](shm::SourceId source) { return live_.name_of(source).value_or(""); });
    EXPECT_EQ(explained(read_back, port, active), winner) << "as expressions again";
  }

  // The model under examination.
  void check_before_the_table(const rules::CompiledPort& port, const Active& active,
                              const Winner& winner) const {
    EXPECT_EQ(explained(set_, port.port, active), winner) << "by expressions";
    const rules::CompiledRule* found = rules::find_winner(port, active);
    EXPECT_EQ(found == nullptr ? std::nullopt : std::optional(found->source), winner)
        << "by the compiled rules";
  }

  static Winner explained(const rules::RuleSet& set, const std::string& port,
                          const Active& active) {
    const auto is_active = [&](const std::string& source) { return active.contains(source); };
    return rules::Explainer(set).explain(port, is_active).winner;
  }

  const rules::RuleSet& set_;
  const rules::CompiledModel& model_;
  const NaiveEvaluator& naive_;
  LiveTable live_;
};

class EvaluatorsAgree : public testing::TestWithParam<Precedence> {};

TEST_P(EvaluatorsAgree, OnRandomModelsInEveryState) {
  const Vocabulary words;
  const bool is_proved = GetParam() == Precedence::kProved;
  int compared = 0;
  for (unsigned seed = 0; seed < rounds(60u) && !HasFailure(); ++seed) {
    const RandomModel random = Generator(seed).model();
    const std::string xml =
        to_xml(random, is_proved ? std::set<std::string>()
                                 : std::set(words.ports.begin(), words.ports.end()));
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + xml);
    const TemporaryDirectory directory;
    rules::Diagnostics diagnostics;
    const auto set = rules::load({{directory.write("model.xml", xml)}, {}}, diagnostics);
    const std::size_t nodes = GetParam() == Precedence::kInOrder ? 0 : rules::kMaxPrecedenceNodes;
    const auto model = rules::compile(set, diagnostics, nodes);
    if (diagnostics.has_errors()) continue;  // two that can both win
    ++compared;
    const NaiveEvaluator naive(random);
    Evaluators evaluators(set, model, naive);
    for (const auto& active : subsets(words.sources)) evaluators.check(active);
  }
  EXPECT_GT(compared, rounds(is_proved ? 10 : 50));
}

std::string name_of_case(const testing::TestParamInfo<Precedence>& info) {
  switch (info.param) {
    case Precedence::kProved:
      return "WithProof";
    case Precedence::kInDiagrams:
      return "WithPrecedenceInDiagrams";
    case Precedence::kInOrder:
      return "InOrder";
  }
  return "";
}

INSTANTIATE_TEST_SUITE_P(, EvaluatorsAgree,
                         testing::Values(Precedence::kProved, Precedence::kInDiagrams,
                                         Precedence::kInOrder),
                         name_of_case);

}  // namespace
}  // namespace arbiter::test
