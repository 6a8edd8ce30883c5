// Which outcomes a recording permits.
#include "evidence/judge.hpp"

#include <gtest/gtest.h>

#include "tests/evidence/incident.hpp"

namespace arbiter::test {
namespace {

using evidence::Judge;
using evidence::Permitted;
using Fate = Incident::Fate;

// Of the decision with that number, by time.
Permitted permitted(Incident& incident, std::size_t number, const std::string& model = kOverride) {
  const auto recorded = incident.read();
  Judge judge(compile_text(model), false);
  Judge::Connection connection{};
  const auto& run = recorded.runs.at(0);
  return judge.permitted(run, run.decisions.at(number), "/p", connection);
}

void expect(const Permitted& permitted, bool wins, bool loses) {
  EXPECT_EQ(permitted.wins, wins);
  EXPECT_EQ(permitted.loses, loses);
}

TEST(Judge, IsSureWhereWhatComesBesideHasBeenSeenBefore) {
  Incident incident;
  incident.arrive("/high", 1100, 1105, Fate::accepted);
  incident.arrive("/low", 1106, 1110, Fate::discarded);
  expect(permitted(incident, 0), true, false);
  expect(permitted(incident, 1), false, true);
}

TEST(Judge, PermitsBothWhereAnOverrideBeginsMeanwhile) {
  Incident incident;
  incident.arrive("/low", 1100, 1110, Fate::accepted);
  incident.arrive("/high", 1105, 1115, Fate::accepted);
  expect(permitted(incident, 0), true, true);
  expect(permitted(incident, 1), true, false);  // whatever /low does
}

TEST(Judge, PermitsBothWhereAnOverrideBeganBeforeAndWasSeenLater) {
  Incident incident;
  incident.arrive("/high", 1095, 1200, Fate::accepted);
  incident.arrive("/low", 1100, 1101, Fate::accepted);
  expect(permitted(incident, 1), true, true);
}

TEST(Judge, IsSureWhereWhatComesMeanwhileOnlyRenews) {
  Incident incident;
  incident.arrive("/high", 1100, 1101, Fate::accepted);
  incident.arrive("/low", 1200, 1210, Fate::discarded);
  incident.arrive("/high", 1205, 1206, Fate::accepted);
  expect(permitted(incident, 1), false, true);
}

TEST(Judge, IsSureOfAnEndByTimeAlone) {
  Incident incident;
  incident.arrive("/high", 1100, 1101, Fate::accepted);
  incident.arrive("/low", 1599, 1650, Fate::discarded);
  incident.arrive("/low", 1600, 1700, Fate::accepted);
  expect(permitted(incident, 1), false, true);  // at the end, though it was seen later
  expect(permitted(incident, 2), true, false);
}

// Who sees what was written later reads the clock again: the end may lie before that.
TEST(Judge, IsUnsureOfAnEndWhereALaterWriteMayHaveBeenSeen) {
  const std::string model = R"(<behaviors timeout="500ns">
    <arbiter at="/p"><select from="/low">not /high and not /other</select></arbiter></behaviors>)";
  Incident incident(model, {"/low", "/high", "/other"});
  incident.arrive("/high", 1100, 1101, Fate::discarded);
  incident.arrive("/low", 1590, 1700, Fate::discarded);
  expect(permitted(incident, 1, model), false, true);
  incident.deactivate("/other", 1595, 1596);
  expect(permitted(incident, 1, model), true, true);
}

// Each alone would do, and at no moment is either there: A gives way to B at one moment.
TEST(Judge, MixesNoMoments) {
  const std::string model = R"(<behaviors timeout="500ns">
    <arbiter at="/p"><select from="/low">not /a and not /b</select></arbiter></behaviors>)";
  Incident incident(model, {"/low", "/a", "/b"});
  incident.arrive("/a", 1100, 1101, Fate::discarded);
  incident.arrive("/low", 1200, 1300, Fate::discarded);
  incident.arrive("/b", 1210, 1220, Fate::discarded);
  incident.deactivate("/a", 1250, 1260);
  expect(permitted(incident, 1, model), false, true);
}

TEST(Judge, KnowsNothingBehindAGap) {
  Incident incident;
  incident.arrive("/high", 1100, 1101, Fate::accepted);
  incident.arrive("/low", 1150, 1151, Fate::discarded);
  incident.state("/high", 1300, 1310, shm::arrival(1300, 500), evidence::SourceState::Why::gap, 3);
  incident.arrive("/low", 1320, 1330, Fate::discarded);
  const Permitted within = permitted(incident, 1);
  expect(within, true, true);
  EXPECT_TRUE(within.rests_on_gap);
  const Permitted behind = permitted(incident, 2);
  expect(behind, false, true);
  EXPECT_FALSE(behind.rests_on_gap);
}

// While it was decided, the recorder lost sight of the other source.
TEST(Judge, PermitsBothWhereAnOverrideCannotBeSeenAnyMoreMeanwhile) {
  Incident incident;
  incident.add(evidence::Missed{"/high", 1050, 1050, 0, 0, evidence::Missed::Why::refused, "full"});
  incident.arrive("/low", 1030, 1035, Fate::accepted);
  incident.arrive("/low", 1040, 1060, Fate::discarded);
  expect(permitted(incident, 0), true, false);
  const Permitted meanwhile = permitted(incident, 1);
  expect(meanwhile, true, true);
  EXPECT_TRUE(meanwhile.rests_on_gap);
}

TEST(Judge, KnowsNothingOfASourceThatCouldNotBeTapped) {
  Incident incident;
  incident.add(evidence::Missed{"/high", 1050, 1050, 0, 0, evidence::Missed::Why::refused, "full"});
  incident.arrive("/low", 1100, 1101, Fate::discarded);
  EXPECT_TRUE(permitted(incident, 0).rests_on_gap);
}

TEST(Judge, AStateThatSaysWhatWasKnownIsNoGap) {
  Incident incident;
  incident.arrive("/high", 1100, 1101, Fate::accepted);
  incident.state("/high", 1100, 1200, shm::arrival(1100, 500), evidence::SourceState::Why::joined);
  incident.arrive("/low", 1150, 1151, Fate::discarded);
  expect(permitted(incident, 1), false, true);
}

TEST(Judge, PermitsAllWhereTooManySourcesAreUncertain) {
  std::string condition = "not /s0";
  std::vector<std::string> sources{"/low", "/s0"};
  for (int i = 1; i < 20; ++i) {
    condition += " and not /s" + std::to_string(i);
    sources.push_back("/s" + std::to_string(i));
  }
  const std::string model = R"(<behaviors timeout="500ns"><arbiter at="/p"><select from="/low">)" +
                            condition + "</select></arbiter></behaviors>";
  Incident incident(model, sources);
  incident.arrive("/low", 1100, 1200, Fate::accepted);
  for (std::size_t i = 1; i < sources.size(); ++i) {
    incident.arrive(sources[i], 1110, 1190, Fate::discarded);
  }
  expect(permitted(incident, 0, model), true, true);
}

// A file may say of every arrival that it was seen at the end: half a megabyte took half a minute.
TEST(Judge, PermitsBothWhereASourceMayHaveTakenTooManySteps) {
  for (const bool is_too_many : {false, true}) {
    Incident incident;
    incident.arrive("/high", 1090, 1091, Fate::accepted, 9000);
    incident.arrive("/low", 1100, 9000, Fate::discarded);
    const std::size_t renewals = evidence::kMostSteps + (is_too_many ? 1 : 0);
    for (std::size_t i = 0; i < renewals; ++i) {
      incident.arrive("/high", 1101, 1102, Fate::accepted, 9000);
    }
    const Permitted found = permitted(incident, 1);
    expect(found, is_too_many, true);
    EXPECT_FALSE(found.rests_on_gap);
  }
}

}  // namespace
}  // namespace arbiter::test
