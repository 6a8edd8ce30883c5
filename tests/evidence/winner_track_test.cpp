// Who wins, from event to event.
#include "evidence/winner_track.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/evidence/incident.hpp"

namespace arbiter::test {
namespace {

using evidence::WinnerChange;
using Why = WinnerChange::Why;

class TrackedWinners : public testing::Test {
 protected:
  TrackedWinners() {
    track_.start(0);
    track_.set_rules(evidence::rule_table_of(simulation_), 1, 0);
  }
  // "TIME PORT WINNER WHY BY", since this was asked last.
  std::vector<std::string> told() {
    std::vector<std::string> lines;
    for (const WinnerChange& each : std::exchange(changes_, {})) {
      lines.push_back(std::to_string(each.time) + ' ' + (each.winner.empty() ? "-" : each.winner) +
                      ' ' + std::string(name_of(each.why)) + ' ' + each.by);
    }
    return lines;
  }
  void arrive(const std::string& source, shm::Nanoseconds time) {
    track_.apply(source, shm::arrival(time, 500), time, Why::arrival);
  }
  using Lines = std::vector<std::string>;

  const rules::CompiledModel model_ = compile_text(kOverride);
  const rules::Simulation simulation_{model_};
  std::vector<WinnerChange> changes_;
  evidence::WinnerTrack track_{
      [this](WinnerChange&& each) { changes_.push_back(std::move(each)); }};
};

TEST_F(TrackedWinners, ChangeByArrivalsAndByEnds) {
  arrive("/low", 100);
  arrive("/high", 200);
  arrive("/low", 300);
  arrive("/low", 650);
  track_.advance(2000);
  EXPECT_EQ(told(), (Lines{"100 /low arrival /low", "200 /high arrival /high",
                           "700 /low expiry /high", "1150 - expiry /low"}));
}

TEST_F(TrackedWinners, ChangeByDeactivation) {
  arrive("/low", 100);
  arrive("/high", 200);
  track_.apply("/high", shm::deactivation(250), 250, Why::deactivation);
  EXPECT_EQ(told().back(), "250 /low deactivation /high");
}

// As by an operator, of which the recorder learns by looking.
TEST_F(TrackedWinners, ChangeWhenADeactivationWasThatIsNoticedLate) {
  arrive("/low", 100);
  arrive("/high", 200);
  track_.advance(290);
  track_.apply("/high", shm::deactivation(250), 290, Why::state);
  EXPECT_EQ(told().back(), "250 /low deactivation /high");
}

// From 250 to 270 nobody may have won.
TEST_F(TrackedWinners, ChangeNoEarlierThanSomethingElseHasMattered) {
  arrive("/high", 200);
  arrive("/low", 270);
  track_.advance(290);
  track_.apply("/high", shm::deactivation(250), 290, Why::state);
  EXPECT_EQ(told().back(), "270 /low deactivation /high");
}

// Names may come and go for as long as it is recorded.
TEST_F(TrackedWinners, AreKnownWithoutTheSourcesThatAreOver) {
  for (int i = 0; i < 100; ++i) arrive("/passing" + std::to_string(i), 100 + i);
  arrive("/low", 150);
  track_.apply("/passing0", shm::deactivation(300), 300, Why::deactivation);
  EXPECT_EQ(track_.sources(), 100u);
  track_.advance(640);
  EXPECT_EQ(track_.sources(), 60u);
  track_.advance(2000);
  EXPECT_EQ(track_.sources(), 0u);
  EXPECT_EQ(told(), (Lines{"150 /low arrival /low", "650 - expiry /low"}));
}

TEST_F(TrackedWinners, ChangeByTheModel) {
  arrive("/low", 100);
  arrive("/high", 200);
  told();
  const auto reversed = compile_text(kReversed);
  const rules::Simulation simulation(reversed);
  track_.set_rules(evidence::rule_table_of(simulation), 2, 300);
  EXPECT_EQ(told(), (Lines{"300 /low model "}));
  track_.set_rules(nullptr, 0, 400);
  EXPECT_EQ(told(), (Lines{"400 - model "}));
}

TEST_F(TrackedWinners, AnActivityMayEndEarlierThanItWasSaidTo) {
  track_.apply("/low", 5000, 100, Why::arrival);
  track_.apply("/low", 700, 200, Why::arrival);
  track_.advance(1000);
  EXPECT_EQ(told().back(), "700 - expiry /low");
}

// As far as nothing else has mattered since.
TEST_F(TrackedWinners, WhatComesLateCountsFromItsTimeOn) {
  track_.advance(250);
  arrive("/low", 200);
  EXPECT_EQ(told().back(), "200 /low arrival /low");
  track_.advance(350);
  arrive("/high", 150);
  EXPECT_EQ(told().back(), "250 /high arrival /high");
}

TEST_F(TrackedWinners, WhatAPublisherFindsMayBeOfLater) {
  arrive("/low", 300);
  track_.join("/high", 600 + 500);
  EXPECT_EQ(told(), (Lines{"300 /low arrival /low"}));
  track_.advance(1000);
  EXPECT_EQ(told(), (Lines{"800 - expiry /low"}));
  track_.join("/high", 900 + 500);
  EXPECT_EQ(told(), (Lines{"1000 /high state /high"}));
}

// An operator has ended it, and what was before is told behind that.
TEST_F(TrackedWinners, WhatWasBeforeADeactivationDoesNotUndoIt) {
  arrive("/low", 300);
  track_.join("/low", shm::deactivation(700));
  arrive("/low", 400);
  track_.apply("/low", 450 + 500, 450, Why::state);
  track_.advance(800);
  EXPECT_EQ(told(), (Lines{"300 /low arrival /low", "700 - deactivation /low"}));
  arrive("/low", 850);
  EXPECT_EQ(told(), (Lines{"850 /low arrival /low"}));
}

// A tap tells of a burst long after the page of its source was read.
TEST_F(TrackedWinners, WhatWasBeforeAPageWasReadChangesNothing) {
  arrive("/low", 900);
  track_.advance(1000);
  track_.read("/high", 990 + 500);
  EXPECT_EQ(told(), (Lines{"900 /low arrival /low", "1000 /high state /high"}));
  track_.apply("/high", 300 + 500, 300, Why::state);
  arrive("/high", 310);
  track_.apply("/high", shm::deactivation(320), 320, Why::deactivation);
  arrive("/high", 990);
  EXPECT_EQ(told(), Lines{});
  track_.apply("/high", shm::deactivation(1100), 1100, Why::deactivation);
  EXPECT_EQ(told(), (Lines{"1100 /low deactivation /high"}));
  track_.advance(1150);
  track_.read("/high", 1150 + 500);
  track_.read("/high", shm::deactivation(1200));
  EXPECT_EQ(told(), (Lines{"1150 /high state /high", "1200 /low deactivation /high"}));
}

// A state bears the time of what was told last, perhaps long before the arrival that it tells of.
TEST_F(TrackedWinners, AStateBehindAReadingTellsOfItsOwnArrival) {
  track_.advance(2000);
  track_.read("/high", 100 + 500);
  track_.advance(3010);
  track_.apply("/high", 3000 + 500, 0, Why::state);
  track_.advance(4000);
  EXPECT_EQ(told(), (Lines{"3010 /high state /high", "3500 - expiry /high"}));
}

// What was read was so when it was read, whatever T is by now.
TEST_F(TrackedWinners, AReadingUnderALongerTimeoutIsNoLaterThanItself) {
  track_.advance(2000);
  track_.read("/high", 1000 + 10'000);
  track_.advance(2100);
  track_.apply("/high", shm::deactivation(4000), 4000, Why::deactivation);
  arrive("/high", 5000);
  track_.advance(6000);
  EXPECT_EQ(told(), (Lines{"2000 /high state /high", "4000 - deactivation /high",
                           "5000 /high arrival /high", "5500 - expiry /high"}));
}

}  // namespace
}  // namespace arbiter::test
