// Statements about an instance that runs: whether they are true now, by the model in force.
#include "watch/live_statement.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "tests/support/error_of.hpp"
#include "tests/watch/watched.hpp"

namespace arbiter::test {
namespace {

using rules::Truth;
using testing::HasSubstr;

// /high inhibits /low at both ports, and has a connection to one of them.
const std::string kTwoPortsModel = R"(<behaviors timeout="forever">
  <behavior name="Low"><config at="/p">/low</config><config at="/q">/low</config></behavior>
  <behavior name="High"><config at="/p">/high</config><inhibition>Low</inhibition></behavior>
</behaviors>
)";

rules::Statement statement_of(const std::string& text) {
  const rules::TextFile file("test", text);
  rules::Diagnostics diagnostics;
  auto statements = rules::read_statements(file, diagnostics);
  EXPECT_EQ(statements.size(), 1u) << text;
  return std::move(statements.front());
}

watch::LiveStatement live(const std::shared_ptr<watch::Instance>& instance,
                          const std::string& text) {
  return {instance, statement_of(text)};
}

// Codes of what is wrong with a statement under the model in force.
std::vector<std::string> faults(const std::shared_ptr<watch::Instance>& instance,
                                const std::string& text) {
  std::vector<std::string> codes;
  try {
    live(instance, text).look();
  } catch (const watch::StatementError& error) {
    for (const auto& item : error.diagnostics().items()) codes.push_back(item.code);
  }
  return codes;
}

// Where the daemon is given so little time that it may miss it once.
Truth known_truth(watch::LiveStatement& statement) {
  for (;;) {
    const Truth truth = statement.look().truth;
    if (truth != Truth::kUnknown) return truth;
  }
}

// Each operand in each of the states that two sources can be in.
TEST(LiveStatement, IsTrueOfTheStateThatDecisionsSee) {
  Daemon daemon(kTwoPortsModel);
  Node node("component");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  const auto instance = watched(daemon);
  struct Row {
    const char* statement;
    const char* truth;  // with nothing, /low, /high, both active
  };
  const std::vector<Row> rows{
      {"/low", "0101"},
      {"not /low and /high", "0010"},
      {"/low -> /high", "1011"},
      {"/low <-> /high", "1001"},
      {"/low xor /high", "0110"},
      {"any(/*)", "0111"},
      {"all(/*)", "0001"},
      {"none(/l*)", "1010"},
      {"winner(/p) = /low", "0100"},
      {"winner(/p) != /low", "1011"},
      {"winner(/p) = any(/*)", "0111"},
      {"winner(/p) = none", "1000"},
      {"idle(/q)", "1011"},
      {"winner(/p) = winner(/q)", "1100"},
      {"winner(/p) = /high and idle(/q) and /low", "0001"},
  };
  for (std::size_t state = 0; state < 4; ++state) {
    low.deactivate();
    high.deactivate();
    if ((state & 1) != 0) low.signal();
    if ((state & 2) != 0) high.signal();
    for (const Row& row : rows) {
      EXPECT_EQ(live(instance, row.statement).look().truth, rules::truth(row.truth[state] == '1'))
          << row.statement << " in state " << state;
    }
  }
}

TEST(LiveStatement, SaysWhoWinsAndWhatIsActive) {
  Daemon daemon(kTwoPortsModel);
  Node node("component");
  auto high = node.output_port<int>("/high");
  high.signal();
  auto statement = live(watched(daemon), "winner(/p) = /high and not /low and idle(/q)");
  const auto look = statement.look();
  EXPECT_EQ(look.truth, Truth::kTrue);
  EXPECT_EQ(look.winners.at("/p"), "/high");
  EXPECT_EQ(look.winners.at("/q"), std::nullopt);
  EXPECT_EQ(look.active, (std::map<std::string, bool>{{"/low", false}}));
}

TEST(LiveStatement, OfNamesThatTheModelLacksIsAnError) {
  Daemon daemon(kTwoPortsModel);
  Node node("component");
  auto other = node.output_port<int>("/other");
  auto in = node.input_port<int>("/in");
  const auto instance = watched(daemon);
  using testing::ElementsAre;
  EXPECT_THAT(faults(instance, "/other"), ElementsAre("unknown-source"));
  EXPECT_THAT(faults(instance, "idle(/in)"), ElementsAre("unknown-port"));
  EXPECT_THAT(faults(instance, "winner(/q) = /high"), ElementsAre("not-connected"));
  EXPECT_THAT(faults(instance, "winner(/p) = winner(/r) and /x"),
              ElementsAre("unknown-port", "unknown-source"));
  EXPECT_THAT(faults(instance, "/low"), ElementsAre());
}

TEST(LiveStatement, AboutNothingThatMatchesIsWarnedOf) {
  Daemon daemon(kTwoPortsModel);
  auto statement = live(watched(daemon), "none(/x*) and winner(/q) != any(/h*)");
  EXPECT_EQ(statement.look().truth, Truth::kTrue);
  EXPECT_EQ(statement.diagnostics().count(rules::Severity::kWarning, "matches-nothing"), 2u);
}

TEST(LiveStatement, IsOfTheModelThatIsInForce) {
  Daemon daemon(kTwoPortsModel);
  Node node("component");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  low.signal();
  high.signal();
  const auto instance = watched(daemon);
  auto statement = live(instance, "winner(/p) = /low and any(/n*)");
  EXPECT_EQ(statement.look().truth, Truth::kFalse);
  // Ports and sources that are new, and another winner.
  daemon.load(R"(<behaviors timeout="forever">
    <arbiter at="/new"><select from="/new:o"/></arbiter>
    <arbiter at="/p"><select from="/low">/high</select></arbiter></behaviors>)");
  EXPECT_EQ(statement.look().truth, Truth::kFalse) << "/new:o is silent";
  auto newcomer = node.output_port<int>("/new:o");
  newcomer.signal();
  EXPECT_EQ(statement.look().truth, Truth::kTrue);
  EXPECT_EQ(statement.generation(), 2u);
  daemon.load("<behaviors><arbiter at='/p'><select from='/high'/></arbiter></behaviors>");
  EXPECT_THAT(error_of([&] { statement.look(); }),
              HasSubstr("model 3, which is in force, gives this condition no meaning"));
  daemon.load(kTwoPortsModel);
  EXPECT_EQ(statement.look().truth, Truth::kFalse);
}

TEST(LiveStatement, GoesOnWhileNoDaemonRuns) {
  Daemon daemon(kTwoPortsModel);
  Node node("component");
  auto high = node.output_port<int>("/high");
  const auto instance = watched(daemon);
  auto statement = live(instance, "winner(/p) = /high");
  EXPECT_EQ(statement.look().truth, Truth::kFalse);
  daemon.kill();
  update_until(*instance, [&] { return !instance->has_daemon(); });
  high.signal();
  EXPECT_EQ(statement.look().truth, Truth::kTrue);
  high.deactivate();
  daemon.restart();
  update_until(*instance, [&] { return instance->has_daemon(); });
  EXPECT_EQ(statement.look().truth, Truth::kFalse);
}

TEST(LiveStatement, IsUnknownWhileNobodyTellsTheNamesOfAnotherModel) {
  Daemon daemon(kTwoPortsModel);
  wire::Caller caller = caller_of(daemon);
  caller.answer_time = std::chrono::milliseconds(300);
  const auto instance = watched_by(caller);
  auto statement = live(instance, "idle(/p)");
  EXPECT_EQ(known_truth(statement), Truth::kTrue);
  daemon.load(kTwoPortsModel);
  daemon.process().stop();
  EXPECT_EQ(statement.look().truth, Truth::kUnknown);
  daemon.process().resume();
  EXPECT_EQ(known_truth(statement), Truth::kTrue);
}

// What the old one's components do is seen no more: they are strangers there.
TEST(LiveStatement, IsOfTheMemoryOfADaemonThatComesWithItsOwn) {
  Daemon daemon(kTwoPortsModel);
  const auto instance = watched(daemon);
  {
    Node node("component");
    auto high = node.output_port<int>("/high");
    high.signal();
    auto statement = live(instance, "/high");
    EXPECT_EQ(statement.look().truth, Truth::kTrue);
  }
  auto statement = live(instance, "/high and idle(/p) or not /high");
  EXPECT_EQ(statement.look().truth, Truth::kFalse);
  daemon.kill();
  daemon.lose_state();
  daemon.restart();
  update_until(*instance, [&] { return instance->daemons() == 2; });
  EXPECT_EQ(statement.look().truth, Truth::kTrue);
}

TEST(LiveStatement, NeedsAModel) {
  Daemon daemon("", {.without_model = true});
  auto statement = live(watched(daemon), "/high");
  EXPECT_THAT(error_of([&] { statement.look(); }), HasSubstr("no model is in force"));
}

}  // namespace
}  // namespace arbiter::test
