// Section III, Port-Arbitrated Coordination: rules written by hand, and how an arbitrator uses
// them.
#include <gmock/gmock.h>

#include "rules/explain/simulation.hpp"
#include "tests/paper/paper_model.hpp"

namespace arbiter::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

const char* const kRestArmAlone = R"(
<arbiter at="/Arm/pos:i">
  <select from="/RestArm/pos:o">/RestArm/pos:o and not /Object/pos:o</select>
</arbiter>)";

const char* const kWithCollision = R"(
<arbiter at="/Arm/pos:i">
  <select from="/RestArm/pos:o">/RestArm/pos:o ∧ ¬/Object/pos:o ∧ ¬/collision:o</select>
  <select from="/Object/pos:o">/Object/pos:o ∧ ¬/collision:o</select>
</arbiter>)";

// Figure 2: the shaded arbitrator of Arm Control has three connections.
const char* const kFigure2 = R"(
<application>
  <connection><from>/Object/pos:o</from><to>/Gaze/pos:i</to></connection>
  <connection><from>/Object/pos:o</from><to>/Arm/pos:i</to></connection>
  <connection><from>/RestArm/pos:o</from><to>/Arm/pos:i</to></connection>
  <connection><from>/collision:o</from><to>/Arm/pos:i</to></connection>
</application>)";

std::vector<rules::OutcomeRow> replay(rules::Simulation& simulation,
                                      const std::vector<rules::TraceEvent>& events) {
  std::vector<rules::OutcomeRow> rows;
  for (const auto& event : events) {
    for (auto& row : simulation.step(event)) rows.push_back(std::move(row));
  }
  return rows;
}

constexpr shm::Nanoseconds kMillisecond = 1'000'000;

rules::TraceEvent arrival(shm::Nanoseconds milliseconds, const std::string& source) {
  return {milliseconds * kMillisecond, rules::TraceKind::kArrival, source};
}

TEST(Section3, ARuleSelectsTheRestingArmOnlyWhileTheObjectIsInactive) {
  const auto model = load_text(kRestArmAlone);
  EXPECT_THAT(model.codes(), IsEmpty());
  EXPECT_THAT(model.rules_at(kArm), ElementsAre("/RestArm/pos:o ∧ ¬/Object/pos:o"));
  EXPECT_EQ(model.winner(kArm, {}), "-");
  EXPECT_EQ(model.winner(kArm, {kRestArm}), kRestArm);
  EXPECT_EQ(model.winner(kArm, {kObject}), "-");
  EXPECT_EQ(model.winner(kArm, {kRestArm, kObject}), "-");
}

TEST(Section3, ACollisionStopsBothTheRestingArmAndTheObject) {
  const auto model = load_text(kWithCollision);
  EXPECT_THAT(model.codes(), IsEmpty());
  EXPECT_THAT(model.rules_at(kArm), ElementsAre("/RestArm/pos:o ∧ ¬/Object/pos:o ∧ ¬/collision:o",
                                                "/Object/pos:o ∧ ¬/collision:o"));
  for (const auto& active : subsets({kRestArm, kObject, kCollision})) {
    std::string expected = "-";
    if (active.contains(kRestArm)) expected = kRestArm;
    if (active.contains(kObject)) expected = kObject;
    if (active.contains(kCollision)) expected = "-";
    EXPECT_EQ(model.winner(kArm, active), expected) << testing::PrintToString(active);
  }
}

TEST(Section3, AtMostOneConnectionDeliversAtEachTime) {
  const auto model = load_text(kWithCollision, kFigure2);
  for (const auto& active : subsets({kRestArm, kObject, kCollision})) {
    model.live->activate_only(active);
    EXPECT_LE(model.live->winners(kArm).size(), 1u);
  }
}

TEST(Section3, AConnectionThatNoRuleSelectsNeverDeliversYetIsSeenByTheRulesOfOthers) {
  const auto model = load_text(kWithCollision, kFigure2);
  for (const auto& active : subsets({kRestArm, kObject, kCollision})) {
    model.live->activate_only(active);
    EXPECT_FALSE(model.live->delivers(kCollision, kArm));
  }
  EXPECT_EQ(model.winner(kArm, {kObject, kCollision}), "-");
}

TEST(Section3, ASourceNeedsNoConnectionToBeReadByARule) {
  const auto model = load_text(kWithCollision);
  EXPECT_EQ(model.live->view().connections_of_source(model.live->source_id(kCollision)).count, 0u);
  EXPECT_EQ(model.winner(kArm, {kObject, kCollision}), "-");
}

TEST(Section3, APortWithoutRulesHasNoArbitrator) {
  const auto model = load_text(kWithCollision, kFigure2);
  EXPECT_FALSE(model.live->view().is_arbitrated(model.live->port_id(kGaze)));
  model.live->activate_only({kObject, kCollision});
  EXPECT_TRUE(model.live->delivers(kObject, kGaze));
}

TEST(Section3, AConnectionIsActiveForATimeTAfterItsLastData) {
  const auto model = load_text(kWithCollision);
  rules::Simulation simulation(model.compiled);
  const std::vector<rules::TraceEvent> events = {arrival(0, kObject), arrival(499, kRestArm),
                                                 arrival(500, kRestArm)};
  const auto rows = replay(simulation, events);
  EXPECT_FALSE(rows.at(1).outcome.delivered);
  EXPECT_TRUE(rows.at(2).outcome.delivered);
}

TEST(Section3, ActivationIsIrrespectiveOfTheResultOfTheArbitration) {
  const auto model = load_text(kWithCollision);
  rules::Simulation simulation(model.compiled);
  const std::vector<rules::TraceEvent> events = {arrival(0, kCollision), arrival(400, kObject),
                                                 arrival(600, kRestArm)};
  const auto rows = replay(simulation, events);
  EXPECT_FALSE(rows.at(1).outcome.delivered) << "the collision forbids it";
  EXPECT_FALSE(rows.at(2).outcome.delivered) << "the object's discarded sample counts";
}

TEST(Section3, RulesAreStructuredAsDecisionDiagrams) {
  const auto model = load_text(R"(<arbiter at="/Arm/pos:i">
    <select from="/RestArm/pos:o">/Object/pos:o xor /collision:o</select></arbiter>)");
  const auto& rule = model.compiled.ports.at(0).rules.at(0);
  EXPECT_EQ(rule.kind, shm::table::kDiagram);
  EXPECT_EQ(rule.nodes.size(), 3u);
  EXPECT_THAT(rule.reads, ElementsAre(kObject, kCollision));
}

}  // namespace
}  // namespace arbiter::test
