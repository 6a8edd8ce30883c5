// What is told of a connection that loses: in the terms of the model, and where it is written.
#include "rules/explain/explain.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class Explained : public testing::Test {
 protected:
  // The connection from `source` at /p while just these are active.
  ConnectionExplanation connection(const std::string& model, const std::string& source,
                                   const std::set<std::string>& active,
                                   const std::string& port = "/p") {
    loaded_ = load_text(model);
    EXPECT_FALSE(loaded_.has_errors) << loaded_.message();
    port_ = Explainer(loaded_.rules).explain(port, [&](const std::string& name) {
      return active.contains(name);
    });
    for (const auto& each : port_.connections) {
      if (each.source == source) return each;
    }
    ADD_FAILURE() << "no connection from " << source;
    return {};
  }
  static const Cause& only_cause(const ConnectionExplanation& connection) {
    static const Cause kNone;
    EXPECT_EQ(connection.parts.size(), 1u);
    if (connection.parts.size() != 1) return kNone;
    EXPECT_EQ(connection.parts[0].causes.size(), 1u);
    return connection.parts[0].causes.empty() ? kNone : connection.parts[0].causes[0];
  }
  static std::vector<std::string> said(const std::vector<Literal>& literals) {
    std::vector<std::string> result;
    for (const auto& each : literals) result.push_back((each.active ? "" : "not ") + each.source);
    return result;
  }
  static std::string place(const Location& where) {
    return std::to_string(where.line) + ":" + std::to_string(where.column);
  }

  Loaded loaded_;
  PortExplanation port_;
};

const std::string kThrough = R"(<behaviors>
<meta_behavior name="Curious"><behavior>Low</behavior>
  <condition>/ready or (/a and /b)</condition></meta_behavior>
<behavior name="Low"><config at="/p">/low</config></behavior>
<meta_behavior name="Alert"><behavior>High</behavior><behavior>Higher</behavior>
  <inhibition>Curious</inhibition></meta_behavior>
<behavior name="High"><config at="/p">/high</config></behavior>
<behavior name="Higher"><config at="/p">/higher</config><inhibition>High</inhibition></behavior>
</behaviors>)";

TEST_F(Explained, AnInhibitionTellsByWhomThroughWhomAndWhere) {
  const auto low = connection(kThrough, "/low", {"/low", "/high", "/higher", "/ready"});
  EXPECT_FALSE(low.wins);
  EXPECT_EQ(port_.winner, "/higher");
  const Cause& cause = only_cause(low);
  EXPECT_EQ(cause.kind, Cause::Kind::kInhibited);
  EXPECT_EQ(cause.inhibitor->name, "Alert");
  EXPECT_TRUE(cause.inhibitor->is_meta);
  EXPECT_EQ(cause.speaker->name, "Higher") << "of those that speak, the one that wins";
  EXPECT_EQ(cause.of->name, "Curious");
  EXPECT_TRUE(cause.of->is_meta);
  EXPECT_EQ(place(cause.where), "6:15");
  EXPECT_FALSE(cause.across_ports);
  EXPECT_THAT(said(cause.because), ElementsAre("/higher"));
  EXPECT_THAT(cause.also, ElementsAre("/high"));
}

// Each of the two is enough to keep the plan out; what one sees is who commands.
TEST_F(Explained, OfCausesThatAreEnoughTheWinnersStandsInFront) {
  const std::string apart = R"(<behaviors>
<behavior name="Plan"><config at="/p">/plan</config>
  <condition>not /bumper</condition></behavior>
<behavior name="Drive"><config at="/p">/operator</config><inhibition>Plan</inhibition></behavior>
</behaviors>)";
  const auto causes = connection(apart, "/plan", {"/plan", "/operator", "/bumper"}).parts[0].causes;
  ASSERT_EQ(causes.size(), 2u);
  EXPECT_EQ(causes[0].kind, Cause::Kind::kInhibited);
  EXPECT_THAT(said(causes[0].because), ElementsAre("/operator"));
  EXPECT_THAT(said(causes[1].because), ElementsAre("/bumper"));

  const std::string together = R"(<behaviors>
<behavior name="Plan"><config at="/p">/plan</config>
  <condition>not /bumper and not /operator</condition></behavior>
<behavior name="Drive"><config at="/p">/operator</config></behavior>
</behaviors>)";
  const std::set<std::string> all{"/plan", "/operator", "/bumper"};
  EXPECT_THAT(said(only_cause(connection(together, "/plan", all)).because),
              ElementsAre("/operator"));
  EXPECT_THAT(said(*connection(together, "/plan", all).reason()), ElementsAre("/operator"));
  EXPECT_THAT(said(only_cause(connection(together, "/plan", {"/plan", "/bumper"})).because),
              ElementsAre("/bumper"));
}

TEST_F(Explained, AConditionTellsWhoseItIsAndTheSmallestReason) {
  const auto low = connection(kThrough, "/low", {"/low", "/b"});
  const Cause& cause = only_cause(low);
  EXPECT_EQ(cause.kind, Cause::Kind::kConditionFalse);
  EXPECT_EQ(cause.of->name, "Curious");
  EXPECT_EQ(cause.condition, "/ready ∨ /a ∧ /b");
  EXPECT_EQ(place(cause.where), "3:3");
  EXPECT_THAT(said(cause.because), ElementsAre("not /a", "not /ready"));
  EXPECT_EQ(low.parts[0].behaviour->name, "Low");
  EXPECT_EQ(place(low.parts[0].where), "4:22");
}

TEST_F(Explained, WhatIsInactiveLosesByThat) {
  const auto low = connection(kThrough, "/low", {"/ready"});
  EXPECT_FALSE(low.is_active);
  EXPECT_THAT(low.parts[0].causes, IsEmpty()) << "else it would win";
  EXPECT_THAT(said(*low.reason()), ElementsAre("not /low"));
  EXPECT_FALSE(port_.winner);
}

const std::string kReadsItself = R"(<behaviors><source port="/Nav/other"/>
<behavior name="Drive"><config at="/p">/Nav/vel</config>
  <condition>none(/Nav/*) or /ok</condition></behavior></behaviors>)";

TEST_F(Explained, AConditionThatReadsItsOwnSourceIsJudgedAsIfThatWereActive) {
  using OwnActivity = Cause::OwnActivity;
  const auto waiting = connection(kReadsItself, "/Nav/vel", {});
  EXPECT_EQ(only_cause(waiting).own_activity, OwnActivity::kWillMatter);
  EXPECT_THAT(said(only_cause(waiting).because), ElementsAre("not /ok"));
  const auto out = connection(kReadsItself, "/Nav/vel", {"/Nav/vel"});
  EXPECT_EQ(only_cause(out).own_activity, OwnActivity::kMatters);
  EXPECT_THAT(said(*out.reason()), ElementsAre("not /ok"));
  const auto other = connection(kReadsItself, "/Nav/vel", {"/Nav/vel", "/Nav/other"});
  EXPECT_EQ(only_cause(other).own_activity, OwnActivity::kNoMatter) << "/Nav/other is enough";
  EXPECT_THAT(connection(kReadsItself, "/Nav/vel", {"/ok"}).parts.at(0).causes, IsEmpty());
  const std::string wants_itself =
      R"(<arbiter at="/p"><select from="/a">/a and /ok</select></arbiter>)";
  EXPECT_THAT(connection(wants_itself, "/a", {"/ok"}).parts.at(0).causes, IsEmpty());
}

TEST_F(Explained, AnInhibitionByItsOwnSourceIsToldBeforeItIsActive) {
  const auto shared = connection(R"(<behaviors>
<behavior name="A"><config at="/p">/s</config></behavior>
<behavior name="B"><config at="/q">/s</config><inhibition>A</inhibition></behavior>
</behaviors>)",
                                 "/s", {});
  EXPECT_EQ(only_cause(shared).own_activity, Cause::OwnActivity::kWillMatter);
  EXPECT_THAT(only_cause(shared).because, IsEmpty());
}

TEST_F(Explained, AnInhibitionByItsOwnSourceAndOthersIsNotByItsOwnActivity) {
  const std::string model = R"(<behaviors>
<behavior name="A"><config at="/p">/s</config></behavior>
<behavior name="B"><config at="/q">/s</config><config at="/q">/x</config>
  <inhibition>A</inhibition></behavior>
</behaviors>)";
  for (const bool is_active : {false, true}) {
    const std::set<std::string> active =
        is_active ? std::set<std::string>{"/s", "/x"} : std::set<std::string>{"/x"};
    const auto shared = connection(model, "/s", active);
    const Cause& cause = only_cause(shared);
    EXPECT_EQ(cause.own_activity, Cause::OwnActivity::kNoMatter) << "/x inhibits, too";
    EXPECT_THAT(cause.because, IsEmpty()) << "once /x is inactive, it inhibits itself";
    EXPECT_THAT(cause.also, ElementsAre("/x"));
  }
}

TEST_F(Explained, WhatIsInactiveIsToldOfTheEarlierOneThatWouldWinAllTheSame) {
  const std::string model = R"(<behaviors><arbiter at="/p" conflict="first">
<select from="/high">/go</select><select from="/yields">not /low</select>
<select from="/low"/></arbiter></behaviors>)";
  EXPECT_EQ(connection(model, "/low", {"/high", "/go"}).earlier, "/high");
  EXPECT_FALSE(connection(model, "/low", {"/high"}).earlier);
  EXPECT_FALSE(connection(model, "/low", {"/yields"}).earlier) << "it yields to it then";
}

TEST_F(Explained, AWinnerNeedsNoReason) {
  const auto low = connection(kThrough, "/low", {"/low", "/ready"});
  EXPECT_TRUE(low.wins);
  EXPECT_FALSE(low.reason());
  EXPECT_EQ(port_.winner, "/low");
}

TEST_F(Explained, WhatSeveralBehavioursConfigureLosesForEachOfThem) {
  const auto shared = connection(R"(<behaviors>
<behavior name="A"><config at="/p">/s</config><condition>/a</condition></behavior>
<behavior name="B"><config at="/p">/s</config><condition>not /b</condition></behavior>
</behaviors>)",
                                 "/s", {"/s", "/b"});
  ASSERT_EQ(shared.parts.size(), 2u);
  EXPECT_EQ(shared.parts[0].behaviour->name, "A");
  EXPECT_EQ(shared.parts[1].behaviour->name, "B");
  EXPECT_THAT(said(*shared.reason()), ElementsAre("not /a", "/b"));
}

TEST_F(Explained, AnInhibitorFromAnotherPortIsToldAsOne) {
  const auto low = connection(R"(<behaviors>
<behavior name="Low"><config at="/p">/low</config></behavior>
<behavior name="Stop"><config at="/q">/stop</config><inhibition>Low</inhibition></behavior>
</behaviors>)",
                              "/low", {"/low", "/stop"});
  EXPECT_TRUE(only_cause(low).across_ports);
  EXPECT_THAT(port_.senses, ElementsAre("/stop"));
}

TEST_F(Explained, AQuantifierIsToldAsItIsWritten) {
  const auto low = connection(R"(<behaviors>
<behavior name="Low"><config at="/p">/low</config><condition>none(/stop/*)</condition></behavior>
<source port="/stop/1"/><source port="/stop/2"/></behaviors>)",
                              "/low", {"/low", "/stop/2"});
  EXPECT_EQ(only_cause(low).condition, "none(/stop/*)");
  EXPECT_THAT(said(only_cause(low).because), ElementsAre("/stop/2"));
}

TEST_F(Explained, ASelectTellsWhereItIs) {
  const auto low = connection(R"(<behaviors><arbiter at="/p">
<select from="/low">not /high</select><select from="/high"/></arbiter></behaviors>)",
                              "/low", {"/low", "/high"});
  EXPECT_FALSE(low.parts.at(0).behaviour);
  EXPECT_FALSE(only_cause(low).of);
  EXPECT_EQ(place(only_cause(low).where), "2:1");
  EXPECT_EQ(only_cause(low).condition, "¬/high");
}

TEST_F(Explained, WhereTheFirstWinsTheOthersAreToldWhoWasFirst) {
  const auto low = connection(R"(<behaviors><arbiter at="/p" conflict="first">
<select from="/high">/a or /b</select><select from="/low"/></arbiter></behaviors>)",
                              "/low", {"/low", "/high", "/b"});
  EXPECT_TRUE(low.holds);
  EXPECT_FALSE(low.wins);
  EXPECT_EQ(low.earlier, "/high");
  EXPECT_THAT(said(*low.reason()), ElementsAre("/b", "/high"));
}

TEST_F(Explained, OneConnectionIsExplainedWithoutTheOthers) {
  const auto loaded = load_text(R"(<behaviors><arbiter at="/p" conflict="first">
<select from="/high">/go</select><select from="/low">/other</select></arbiter></behaviors>)");
  std::set<std::string> asked;
  const auto high =
      Explainer(loaded.rules).explain_connection("/p", "/high", [&](const std::string& source) {
        asked.insert(source);
        return source == "/high" || source == "/go";
      });
  ASSERT_TRUE(high);
  EXPECT_TRUE(high->wins);
  EXPECT_THAT(asked, ElementsAre("/go", "/high"));
}

TEST_F(Explained, AConditionThatNothingSatisfiesHasAnEmptyReason) {
  const auto low = connection(
      R"(<arbiter at="/p"><select from="/low">/a and not /a</select></arbiter>)", "/low", {"/low"});
  EXPECT_THAT(only_cause(low).because, IsEmpty());
}

TEST_F(Explained, AConnectionThatNoRuleSelectsSaysSo) {
  const auto loaded =
      load_with_application(R"(<behavior name="Low"><config at="/p">/low</config></behavior>)",
                            R"(<application><connection><from>/low</from><to>/p</to></connection>
<connection><from>/other</from><to>/p</to></connection>
<connection><from>/other</from><to>/free</to></connection></application>)");
  const Explainer explainer(loaded.rules);
  const auto all = [](const std::string&) { return true; };
  const auto port = explainer.explain("/p", all);
  ASSERT_EQ(port.connections.size(), 2u);
  EXPECT_FALSE(port.connections[1].has_rule);
  EXPECT_THAT(*port.connections[1].reason(), IsEmpty());
  const auto free = explainer.explain("/free", all);
  EXPECT_EQ(free.connections.size(), 1u);
  EXPECT_FALSE(free.winner);
  EXPECT_THAT(explainer.explain("/nowhere", all).connections, IsEmpty());
  const auto other = explainer.explain_connection("/free", "/other", all);
  ASSERT_TRUE(other);
  EXPECT_FALSE(other->has_rule);
  EXPECT_FALSE(explainer.explain_connection("/free", "/low", all));
  EXPECT_FALSE(explainer.explain_connection("/nowhere", "/low", all));
  EXPECT_THAT(explainer.ports(), ElementsAre("/free", "/p"));
}

TEST_F(Explained, AConnectionThatNoRuleSelectsHasAPlaceAndPerhapsAReader) {
  const auto loaded = load_with_application(
      R"(<behaviors><arbiter at="/p"><select from="/low"/></arbiter>
<arbiter at="/q"><select from="/low">not /read</select></arbiter></behaviors>)",
      R"(<application><connection><from>/low</from><to>/p</to></connection>
<connection><from>/low</from><to>/q</to></connection>
<connection><from>/read</from><to>/p</to></connection>
<connection><from>/other</from><to>/p</to></connection></application>)");
  const auto port = Explainer(loaded.rules).explain("/p", [](const std::string&) { return false; });
  ASSERT_EQ(port.connections.size(), 3u);
  EXPECT_TRUE(port.connections[1].is_read) << "at /q";
  EXPECT_EQ(port.connections[1].where.line, 3u);
  EXPECT_FALSE(port.connections[2].is_read);
  EXPECT_EQ(port.connections[2].where.line, 4u);
}

TEST_F(Explained, ATimeoutHasThePlaceWhereItIsWrittenAndTheDefaultHasNone) {
  const auto line = [](const Loaded& loaded, const std::string& source) {
    const Location where = Explainer(loaded.rules).place_of_timeout(source);
    return where.file.empty() ? 0u : where.line;
  };
  const std::string rest = R"(
<source port="/own" timeout="1s"/><source port="/declared"/>
<arbiter at="/p"><select from="/own"/></arbiter></behaviors>)";
  const auto all = load_text("<behaviors timeout='2s'>" + rest);
  EXPECT_EQ(line(all, "/own"), 2u);
  EXPECT_EQ(line(all, "/declared"), 1u);
  EXPECT_EQ(line(all, "/other"), 1u);
  const auto own = load_text("<behaviors>" + rest);
  EXPECT_EQ(line(own, "/own"), 2u);
  EXPECT_EQ(line(own, "/declared"), 0u);
}

}  // namespace
}  // namespace arbiter::rules
