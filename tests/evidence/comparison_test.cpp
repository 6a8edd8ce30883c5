// What would have happened under another model.
#include "evidence/comparison.hpp"

#include <gtest/gtest.h>

#include "tests/evidence/incident.hpp"

namespace arbiter::test {
namespace {

using Fate = Incident::Fate;

evidence::Comparison compare_with(Incident& incident, const std::string& model,
                                  evidence::Recorded& recorded) {
  recorded = incident.read();
  evidence::Models models(compile_texts);
  evidence::Judge other(compile_text(model), true);
  return compare(recorded, models, other);
}

// To and fro: /high from 1100 to 1600, /low from 1050 to 1800.
void override_for_a_while(Incident& incident) {
  incident.arrive("/low", 1050, 1051, Fate::accepted);
  incident.arrive("/high", 1100, 1101, Fate::accepted);
  incident.arrive("/low", 1300, 1301, Fate::discarded);
}

TEST(Comparison, FindsNoDifferenceFromTheSameModel) {
  Incident incident;
  override_for_a_while(incident);
  evidence::Recorded recorded;
  const auto result = compare_with(incident, kOverride, recorded);
  EXPECT_EQ(result.decisions, 3u);
  EXPECT_EQ(result.same, 3u);
  EXPECT_TRUE(result.changed.empty());
  EXPECT_TRUE(result.intervals.empty());
}

TEST(Comparison, ListsDecisionsAndIntervalsThatDiffer) {
  Incident incident;
  override_for_a_while(incident);
  incident.deactivate("/low", 1900, 1901);  // so that the recording goes on until then
  evidence::Recorded recorded;
  const auto result = compare_with(incident, kReversed, recorded);
  ASSERT_EQ(result.changed.size(), 2u);
  EXPECT_EQ(result.changed[0].live.decision->context->source, "/high");
  EXPECT_EQ(result.changed[1].live.decision->context->source, "/low");
  ASSERT_EQ(result.intervals.size(), 1u);
  EXPECT_EQ(result.intervals[0].port, "/p");
  EXPECT_EQ(result.intervals[0].from, 1100);
  EXPECT_EQ(result.intervals[0].to, 1600);
  EXPECT_EQ(result.intervals[0].recorded, "/high");
  EXPECT_EQ(result.intervals[0].other, "/low");
}

TEST(Comparison, ActivitiesLastAsTheOtherModelSays) {
  Incident incident;
  override_for_a_while(incident);
  incident.arrive("/low", 1560, 1561, Fate::discarded);
  std::string quicker = kOverride;
  quicker.replace(quicker.find("500ns"), 5, "450ns");
  evidence::Recorded recorded;
  const auto result = compare_with(incident, quicker, recorded);
  ASSERT_EQ(result.changed.size(), 1u);
  EXPECT_EQ(result.changed[0].live.decision->arrival().time, 1560);
  ASSERT_EQ(result.intervals.size(), 1u);
  EXPECT_EQ(result.intervals[0].from, 1550);
  EXPECT_EQ(result.intervals[0].recorded, "/high");
  EXPECT_EQ(result.intervals[0].other, "/low");
}

TEST(Comparison, SaysWhereTheOtherModelDoesNotConnect) {
  Incident incident;
  incident.arrive("/low", 1050, 1051, Fate::accepted);
  evidence::Recorded recorded;
  const auto result = compare_with(
      incident, R"(<behaviors><arbiter at="/p"><select from="/high"/></arbiter></behaviors>)",
      recorded);
  ASSERT_EQ(result.changed.size(), 1u);
  EXPECT_FALSE(result.changed[0].is_connected);
}

// Live, nothing was decided about /low while /high had the port alone.
TEST(Comparison, CountsWhatTheOtherModelAloneConnects) {
  const std::string alone =
      "<behaviors timeout='500ns'><arbiter at='/p'><select from='/high'/></arbiter></behaviors>";
  Incident incident(alone);
  evidence::PortChange open;
  open.what = evidence::PortChange::What::opened;
  open.is_input = true;
  open.port = "/p";
  open.seen = 1020;
  incident.arrive("/low", 1010, 1011, Fate::none);  // the port was not open yet
  incident.add(open);
  incident.arrive("/high", 1100, 1101, Fate::accepted);
  incident.arrive("/low", 1200, 1201, Fate::none);  // /high keeps it out
  incident.arrive("/low", 1650, 1651, Fate::none);
  incident.arrive("/low", 1700, 1701, Fate::none);
  evidence::Recorded recorded;
  const auto result = compare_with(incident, kOverride, recorded);
  EXPECT_EQ(result.decisions, 3u);
  EXPECT_EQ(result.same, 1u);
  ASSERT_EQ(result.changed.size(), 2u);
  EXPECT_EQ(result.changed[0].live.decision->arrival().time, 1650);
  EXPECT_FALSE(result.changed[0].was_connected);
  EXPECT_FALSE(result.changed[0].goes_on);
  EXPECT_TRUE(result.changed[1].goes_on);
  EXPECT_EQ(compare_with(incident, alone, recorded).decisions, 1u);
}

// A file of 260 KB may have 20 000 models; kept, they took four gigabytes.
TEST(Comparison, KeepsFewOfTheModelsOfARecording) {
  constexpr int kModels = 100;
  Incident incident;
  incident.arrive("/low", 1050, 1051, Fate::accepted);
  for (std::uint64_t generation = 2; generation <= kModels; ++generation) {
    incident.put_in_force(generation % 2 == 0 ? kReversed : kOverride, generation,
                          1100 + static_cast<shm::Nanoseconds>(generation));
  }
  incident.arrive("/high", 1300, 1301, Fate::discarded);
  const evidence::Recorded recorded = incident.read();
  const evidence::Run& run = recorded.runs.front();
  int compiled = 0;
  evidence::Models models([&](const rules::ModelTexts& texts) {
    ++compiled;
    return compile_texts(texts);
  });
  const std::weak_ptr<evidence::Judge> first = models.judge(run, 1);
  // The last model prefers /low, which is active still.
  const auto winners = winners_of(run, models);
  EXPECT_TRUE(first.expired());
  EXPECT_EQ(compiled, kModels);
  ASSERT_EQ(winners.size(), 1u);
  EXPECT_EQ(winners[0].winner, "/low");
  ASSERT_NE(models.judge(run, 1), nullptr);
  EXPECT_EQ(compiled, kModels + 1);
}

}  // namespace
}  // namespace arbiter::test
