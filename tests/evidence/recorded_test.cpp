// A recording as it is loaded: how far it goes, and how much of it is read.
#include "evidence/recorded.hpp"

#include <gtest/gtest.h>

#include "tests/evidence/incident.hpp"

namespace arbiter::test {
namespace {

// A recording in which nothing happens goes on all the same.
TEST(LoadedRecording, EndsWhenRecordingDid) {
  Incident incident;
  incident.arrive("/low", 1010, 1011, Incident::Fate::accepted);
  EXPECT_EQ(incident.read().runs.at(0).end, 1011);
  EXPECT_EQ(evidence::load_recording(incident.file(3000)).runs.at(0).end, 3000);
  EXPECT_EQ(evidence::load_recording(incident.file(1005)).runs.at(0).end, 1011);
  EXPECT_EQ(evidence::load_recording(incident.file(shm::kForever)).runs.at(0).end, 1011)
      << "no time of a clock";
}

TEST(LoadedRecording, EndsWithTheLastChangeOfAWinnerAtLeast) {
  Incident incident;
  incident.arrive("/low", 1010, 1011, Incident::Fate::accepted);
  incident.add(evidence::WinnerChange{"/p", "", "/low", 1510, evidence::WinnerChange::Why::expiry,
                                      "/low", 1});
  EXPECT_EQ(incident.read().runs.at(0).end, 1510);
}

// A night has millions of arrivals, and who won is written beside them.
TEST(LoadedRecording, IsReadWithoutMostArrivalsForTheWinnersAlone) {
  Incident incident;
  for (shm::Nanoseconds i = 0; i < 100; ++i) {
    incident.arrive("/low", 1010 + i, 1011 + i, Incident::Fate::accepted);
  }
  incident.deactivate("/low", 1200, 1210);
  incident.add(evidence::WinnerChange{"/p", "", "/low", 1200,
                                      evidence::WinnerChange::Why::deactivation, "/low", 1});
  incident.arrive("/low", 1300, 1310, Incident::Fate::accepted);
  incident.add(evidence::Start{2000, "test", {}, "none"});
  incident.arrive("/low", 2010, 2011, Incident::Fate::accepted);
  incident.arrive("/high", 2020, 2021, Incident::Fate::accepted);
  const auto recorded = evidence::load_recording(incident.file(), {}, evidence::Wanted::winners);
  ASSERT_EQ(recorded.runs.size(), 2u);
  EXPECT_EQ(recorded.about.records, incident.records().size());
  EXPECT_EQ(recorded.runs[0].winners.size(), 1u);
  EXPECT_EQ(recorded.runs[0].decisions.size(), 1u);
  EXPECT_EQ(recorded.runs[0].end, 1310);
  EXPECT_EQ(recorded.runs[1].decisions.size(), 2u) << "the last of each source";
  EXPECT_EQ(recorded.runs[1].end, 2021);
}

}  // namespace
}  // namespace arbiter::test
