// A component is killed before each atomic operation, and each system call, of all that it does:
// point 0, point 1, and so on until it comes through unharmed. Each time the survivors must go on
// at once, no slot or port may be lost, its names must be free for a successor, and the counters
// must balance.
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <string_view>

#include "tests/kill/scene.hpp"
#include "tests/support/threads.hpp"

namespace {

using namespace std::chrono_literals;
using arbiter::test::make_number;
using arbiter::test::map_segments_of;
using arbiter::test::Scene;
using arbiter::test::Victim;

struct Case {
  const char* name;
  const char* phase;        // of the victim
  void (*prepare)(Scene&);  // when it is about to begin
  void (*meanwhile)(Scene&, Victim&);
  std::uint64_t least_points;  // else the test has lost its points
  // Where there are very many, several tests share them: each takes every so many from one on.
  std::uint64_t first = 0;
  std::uint64_t step = 1;
};
// Without it tests would be named by addresses.
void PrintTo(const Case& its, std::ostream* out) { *out << its.name; }

// The phases of victim_main.cpp that open a tap.
bool taps_survivor(const Case& its) {
  const std::string_view phase = its.phase;
  return phase == "open-tap" || phase == "close-tap" || phase == "take-events" ||
         phase == "wait-for-events";
}

void nothing(Scene&) {}
void just_wait(Scene&, Victim&) {}
void deliver(Scene& scene) {
  for (int i = 0; i < 3; ++i) static_cast<void>(scene.first().publish(make_number(10)));
}
// The oldest head loses then.
void override(Scene& scene) {
  deliver(scene);
  static_cast<void>(scene.second().publish(make_number(20)));
}
// What waits in one queue loses, and nothing else waits.
void silence(Scene& scene) {
  deliver(scene);
  static_cast<void>(scene.second().signal());
}
void watch(Scene& scene) { scene.watch(); }
void wake(Scene& scene, Victim& victim) {
  victim.wait_until_it_polls_or_ends();
  static_cast<void>(scene.first().publish(make_number(10)));
}
// The port's thread takes up a tap, and tells it the state, at its next call.
void tell_the_tap(Scene& scene, Victim& victim) {
  if (victim.has_opened()) static_cast<void>(scene.first().publish(make_number(10)));
}
// The survivor waits while the victim publishes; it must be woken, if not by the victim then by
// what comes after it.
bool wait_too(Scene& scene, Victim& victim) {
  arbiter::test::Watched waiting([&] {
    for (;;) {
      auto sample = scene.in().wait_for(10s);
      if (sample && (*sample)->value == 10) return;
      if (sample.timed_out()) ADD_FAILURE() << "was not woken";
      if (sample.timed_out()) return;
    }
  });
  waiting.wait_until_asleep();
  victim.go();
  const bool unharmed = victim.is_unharmed();
  victim.kill();
  arbiter::test::RawClient client("test");
  client.hello("undertaker");
  client.send(
      arbiter::test::RawClient::message(arbiter::wire::MessageKind::kDeactivate, "/victim:o"));
  client.expect(arbiter::wire::MessageKind::kDone);
  static_cast<void>(scene.first().publish(make_number(10)));
  waiting.join();
  return unharmed;
}

class KilledAtEachPointOf : public testing::TestWithParam<Case> {};

TEST_P(KilledAtEachPointOf, AComponentLeavesAllWell) {
  const Case& what = GetParam();
  Scene scene;
  bool unharmed = false;
  std::uint64_t points = 0;
  for (std::uint64_t point = what.first; !unharmed && !HasFailure(); point += what.step, ++points) {
    SCOPED_TRACE("killed at point " + std::to_string(point));
    scene.open_survivors();
    Victim victim(what.phase, point);
    victim.prepare();
    const auto dead = map_segments_of(victim.pid());
    arbiter::shm::Activity before;
    before.word = scene.page().word.load();
    before.breaks = scene.page().breaks.load();
    what.prepare(scene);
    victim.go();
    what.meanwhile(scene, victim);
    unharmed = victim.is_unharmed();
    victim.kill();
    scene.require_all_is_well(dead, before);
    if (taps_survivor(what)) scene.require_taps_fit();
    scene.close_survivors();
  }
  std::printf("%s: %llu points; the slowest successor had both names after %lld us\n", what.name,
              static_cast<unsigned long long>(points - 1),
              static_cast<long long>(scene.slowest_succession().count()));
  EXPECT_GE(points - 1, what.least_points);
}

INSTANTIATE_TEST_SUITE_P(
    All, KilledAtEachPointOf,
    testing::Values(Case{"Meeting", "meet", nothing, just_wait, 3},
                    Case{"OpeningAnOutputPort", "open-output", nothing, just_wait, 20},
                    Case{"OpeningAnInputPort", "open-input", nothing, just_wait, 10},
                    Case{"ClosingAnOutputPort", "close-output", nothing, just_wait, 3},
                    Case{"ClosingAnInputPort", "close-input", deliver, just_wait, 3},
                    Case{"Joining0", "join", nothing, just_wait, 50, 0, 4},
                    Case{"Joining1", "join", nothing, just_wait, 50, 1, 4},
                    Case{"Joining2", "join", nothing, just_wait, 50, 2, 4},
                    Case{"Joining3", "join", nothing, just_wait, 50, 3, 4},
                    Case{"Publishing", "publish", nothing, just_wait, 20},
                    Case{"PublishingALoan", "publish-loan", nothing, just_wait, 20},
                    Case{"PublishingIntoAFullQueue", "publish-overtaking", nothing, just_wait, 50},
                    Case{"Signalling", "signal", nothing, just_wait, 8},
                    Case{"Deactivating", "deactivate", nothing, just_wait, 3},
                    Case{"Taking", "take", deliver, just_wait, 15},
                    Case{"TakingAndHolding", "take-and-hold", deliver, just_wait, 40},
                    Case{"TakingWhatOverrides", "take", override, just_wait, 20},
                    Case{"DroppingWhatIsOverridden", "take", silence, just_wait, 10},
                    Case{"Waiting", "wait", nothing, wake, 30},
                    Case{"WaitingInVain", "wait-in-vain", nothing, just_wait, 20},
                    Case{"UsingADescriptor", "descriptor", deliver, just_wait, 30},
                    Case{"Relaying", "relay", deliver, just_wait, 40},
                    Case{"PublishingWhatIsTapped", "publish", watch, just_wait, 60},
                    Case{"OvertakingWhatIsTapped", "publish-overtaking", watch, just_wait, 100},
                    Case{"SignallingWhatIsTapped", "signal", watch, just_wait, 40},
                    Case{"DeactivatingWhatIsTapped", "deactivate", watch, just_wait, 30},
                    Case{"ClosingWhatIsTapped", "close-output", watch, just_wait, 10},
                    Case{"OpeningATap", "open-tap", nothing, tell_the_tap, 30},
                    Case{"ClosingATap", "close-tap", deliver, just_wait, 10},
                    Case{"TakingEvents", "take-events", deliver, just_wait, 60},
                    Case{"WaitingForEvents", "wait-for-events", nothing, wake, 30}),
    [](const auto& its) { return its.param.name; });

// Wakes a waiting survivor, or not quite.
TEST(KilledAtEachPointOfWaking, AComponentLeavesNobodyAsleep) {
  Scene scene;
  bool unharmed = false;
  std::uint64_t point = 0;
  for (; !unharmed && !HasFailure(); ++point) {
    SCOPED_TRACE("killed at point " + std::to_string(point));
    scene.open_survivors();
    Victim victim("publish", point);
    victim.prepare();
    unharmed = wait_too(scene, victim);
    scene.close_survivors();
  }
  std::printf("Waking: %llu points\n", static_cast<unsigned long long>(point - 1));
  EXPECT_GE(point - 1, 20u);
}

}  // namespace
