// Taking recorded decisions again.
#include "evidence/verification.hpp"

#include <gtest/gtest.h>

#include "tests/evidence/incident.hpp"

namespace arbiter::test {
namespace {

using evidence::Verification;
using Fate = Incident::Fate;

struct Verified {
  explicit Verified(Incident& incident)
      : recorded(incident.read()), models(compile_texts), result(verify(recorded, models)) {}

  evidence::Recorded recorded;
  evidence::Models models;
  Verification result;
};

TEST(Verification, CountsEachDecisionOnce) {
  Incident incident;
  incident.arrive("/low", 1010, 1011, Fate::accepted);
  incident.arrive("/low", 1020, 1040, Fate::discarded);  // overlapped
  incident.arrive("/high", 1030, 1035, Fate::refused);   // the winner, though refused
  incident.arrive("/high", 1045, 1046, Fate::refused);
  incident.arrive("/low", 1050, 1051, Fate::blind);
  incident.state("/high", 1100, 1110, shm::arrival(1100, 500), evidence::SourceState::Why::gap, 2);
  incident.arrive("/low", 1060, 1061, Fate::discarded);
  const Verified verified(incident);
  EXPECT_EQ(verified.result.equal, 3u);
  EXPECT_EQ(verified.result.overlapped, 1u);
  EXPECT_EQ(verified.result.blind, 1u);
  EXPECT_EQ(verified.result.behind_gap, 1u);
  EXPECT_EQ(verified.result.different, 0u);
  EXPECT_FALSE(verified.result.first);
}

TEST(Verification, SaysWhichIsTheFirstThatDiffers) {
  Incident incident;
  incident.arrive("/high", 1010, 1011, Fate::accepted);
  incident.arrive("/low", 1020, 1021, Fate::discarded);
  incident.arrive("/low", 1030, 1031, Fate::accepted);
  incident.arrive("/low", 1040, 1041, Fate::accepted);
  const Verified verified(incident);
  EXPECT_EQ(verified.result.different, 2u);
  ASSERT_TRUE(verified.result.first);
  EXPECT_EQ(verified.result.first->live.decision->arrival().time, 1030);
  EXPECT_EQ(verified.result.first->text, "the model discards it; by the recording: /high active");
}

TEST(Verification, EachDecisionIsOfItsModel) {
  Incident incident;
  incident.arrive("/high", 1010, 1011, Fate::accepted);
  incident.arrive("/low", 1020, 1021, Fate::discarded);
  incident.put_in_force(kReversed, 2, 1025);
  incident.arrive("/low", 1030, 1031, Fate::accepted);
  incident.arrive("/high", 1040, 1041, Fate::discarded);
  const Verified verified(incident);
  EXPECT_EQ(verified.result.equal, 4u);
}

TEST(Verification, NoticesAnActivityThatLastsForAnotherTime) {
  Incident incident;
  incident.arrive("/high", 1010, 1011, Fate::accepted, 400);
  const Verified verified(incident);
  ASSERT_TRUE(verified.result.first);
  EXPECT_EQ(verified.result.first->text,
            "its source was made active for another time than the model's T");
}

TEST(Verification, TMayBeThatOfTheModelBefore) {
  Incident incident;
  incident.arrive("/high", 1010, 1011, Fate::accepted);
  std::string slower = kOverride;
  slower.replace(slower.find("500ns"), 5, "900ns");
  incident.put_in_force(slower, 2, 1015);
  incident.arrive("/high", 1020, 1021, Fate::accepted, 500);  // stamped, then decided by the next
  incident.arrive("/high", 1030, 1031, Fate::accepted, 900);
  const Verified right(incident);
  EXPECT_EQ(right.result.equal, 3u);
  incident.arrive("/high", 1040, 1041, Fate::accepted, 500);
  const Verified wrong(incident);
  EXPECT_EQ(wrong.result.different, 1u);
}

TEST(Verification, AsksOnlyForChosenPortsAndFromTheStart) {
  Incident incident(kOverride, {"/low", "/high"}, {"/q*"});
  incident.arrive("/low", 1010, 1011, Fate::discarded);
  EXPECT_EQ(Verified(incident).result.all(), 0u);
  Incident early;
  early.arrive("/low", 999, 1011, Fate::discarded);
  EXPECT_EQ(Verified(early).result.all(), 0u);
}

// The taps are at the new daemon's publishers before the recorder has noticed that it is a new one.
TEST(Verification, PassesOverWhatADaemonDecidedThatKnowsNothingOfTheRun) {
  Incident incident;
  incident.arrive("/high", 1010, 1011, Fate::accepted);
  incident.arrive("/low", 1020, 1021, Fate::discarded);
  incident.arrive("/low", 1210, 1211, Fate::accepted);
  incident.add(evidence::Start{1250, "test", {}, "none"});
  incident.state("/low", 0, 1249, shm::arrival(1210, 500));
  incident.state("/high", 0, 1249, shm::kNeverActive);
  incident.put_in_force(kOverride, 1, 1200);
  incident.arrive("/low", 1260, 1261, Fate::accepted);
  const Verified verified(incident);
  EXPECT_EQ(verified.result.different, 0u);
  EXPECT_EQ(verified.result.equal, 3u);
  EXPECT_EQ(evidence::missed_text(verified.recorded), "") << "it is in the recording";
  EXPECT_EQ(verified.recorded.runs[0].left_out, 1u);
  EXPECT_EQ(verified.recorded.runs[1].left_out, 0u);
}

// Of the memory that comes next it is not known since when it is there.
TEST(Verification, LeavesNothingOutWhereNoModelIsInForceNext) {
  Incident incident;
  incident.arrive("/high", 1010, 1011, Fate::accepted);
  incident.arrive("/low", 1020, 1021, Fate::discarded);
  incident.add(evidence::Start{1250, "test", {}, "none"});
  incident.state("/low", 0, 1249, shm::kNeverActive);
  incident.add(evidence::ModelChange{});
  const Verified verified(incident);
  EXPECT_EQ(verified.result.equal, 2u);
  EXPECT_EQ(verified.recorded.runs[0].left_out, 0u);
}

TEST(Verification, CountsWhatWasDecidedByAModelThatIsNotThere) {
  Incident incident;
  incident.arrive("/low", 1010, 1011, Fate::accepted);
  evidence::Record record = incident.records().back();
  std::get<evidence::Arrival>(record).generation = 7;
  std::get<evidence::Arrival>(record).time = 1012;
  incident.add(record);
  const Verified verified(incident);
  EXPECT_EQ(verified.result.without_model, 1u);
  EXPECT_EQ(verified.result.equal, 1u);
}

}  // namespace
}  // namespace arbiter::test
