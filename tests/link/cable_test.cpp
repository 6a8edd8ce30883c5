// Rules 3, 4 and 5 of docs/hosts.md: two hosts with networks of their own, and the cable between
// them pulled. That is silence; what has waited is late; and the last state gets through.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "tests/client/models.hpp"
#include "tests/link/cabled_robot.hpp"
#include "tests/link/known_hosts.hpp"
#include "tests/link/robot.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

constexpr int kUnheard = 100;  // samples that are published during a cut

// 3 in "host head, 3 lost"; 0: it says nothing of that.
int count_in(const std::string& description, const std::string& what) {
  const std::size_t end = description.find(what);
  if (end == std::string::npos) return 0;
  return std::stoi(description.substr(description.rfind(' ', end - 1) + 1));
}

// A cut shorter than the lease: the two do not lose each other. A longer one: they find each other
// again. Either way the motor gets what it falls back to, and then nothing of what was published
// meanwhile.
void cut_and_heal(bool until_gone) {
  CabledRobot robot;
  Host head = robot.head(source_model("300ms"));
  Host base = robot.base(motor_model("300ms"));
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  robot.cables.cut(kHead);
  body.fall_back();
  for (int i = 0; i < kUnheard; ++i) planner.publish();
  const std::int64_t unheard = planner.published();
  if (until_gone) {
    base.see("host head is gone: ");
    base.see("is not imported any more");
    await([&] { return head.daemon().source(kPlanner)["taps"].empty(); });
  } else {
    await([&] { return !head.daemon().source(kPlanner)["active"]; });
  }
  body.fall_back();
  robot.cables.heal(kHead);
  EXPECT_GT(body.drive(planner), unheard);
  // Each of them was lost, or came too late or too soon.
  await([&] {
    planner.publish();
    const std::string described = base.described(kPlanner);
    return count_in(described, " lost") + count_in(described, " late") +
               count_in(described, " before the port was open") >=
           kUnheard;
  });
}

TEST_F(Cable, APulledOneIsSilenceAndNothingOfItComesLate) { cut_and_heal(false); }

TEST_F(Cable, AHostThatWasGoneIsFoundAgain) { cut_and_heal(true); }

// The head hears nobody, and sends to nobody any more; but the base hears its announcements.
TEST_F(Cable, AForeverWinnerThatDoesNotHearUsCommandsNoMore) {
  CabledRobot robot;
  Host head = robot.head(source_model("forever"));
  Host base = robot.base(motor_model("forever"));
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  robot.cables.cut_to(kHead);
  base.see("host head is there, and has not heard this one for 2 s");
  body.await_idle();
  const auto is_head_deaf = [](const wire::HostsDocument& hosts) {
    const wire::HostStatus* const found = hosts.find_host("head");
    return found != nullptr && found->is_deaf;
  };
  EXPECT_EQ(await_hosts("base", is_head_deaf).find_host("head")->round_trip, std::nullopt);
  const ProgramResult shown = run_arbiter("base", {"hosts"});
  EXPECT_EQ(shown.exit_code, 0);
  EXPECT_THAT(shown.out, HasSubstr(" s, deaf "));
  EXPECT_THAT(shown.out, HasSubstr("\n\nwarning: host head is there, and has not heard this one"));
  robot.cables.heal_to(kHead);
  body.drive(planner);
  await_hosts("base", [&](const auto& hosts) { return !is_head_deaf(hosts); });
}

TEST_F(Cable, ASpeakerThatDoesNotHearUsGivesWay) {
  CabledRobot robot;
  const NetworkNamespace rear_network;
  robot.cables.connect(rear_network, 3);
  Host head = robot.head(source_model("300ms"));
  Host base = robot.base(motor_model("300ms"));
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  Host rear = robot.host("rear", source_model("300ms"), rear_network);
  Planner other(rear, planner.published());
  base.await_described(kPlanner, "open on several hosts: head, rear");
  robot.cables.cut_to(kHead);
  base.await_described(kPlanner, "host rear");
  body.drive(other);
}

// While the head hears nobody, nobody hears of the ends of its sources: DDS repeats them only to
// those whose announcements come. Its planner has driven the motor on the base before.
struct UnheardEnd {
  UnheardEnd() {
    body.drive(*planner);
    await_base(true);  // what the base says of itself may come behind what it asks for
    robot.cables.cut_to(kHead);
    base.see("host head is there, and has not heard this one for 2 s");
    await_base(false);
  }
  // Whether the base is up, as the head's link knows.
  static void await_base(bool is_up) {
    await_hosts("head", [&](const wire::HostsDocument& hosts) {
      const auto* const known = hosts.find_host("base");
      return (known != nullptr && known->is_up) == is_up;
    });
  }
  // Returns the number of its last sample once the head's link knows of the end.
  std::int64_t end_planner() {
    const std::int64_t published = planner->published();
    planner.reset();
    await_offer(false);
    return published;
  }
  // Whether components of the head have the planner's port open, as its link knows.
  static void await_offer(bool is_open) {
    await_hosts("head", [&](const wire::HostsDocument& hosts) {
      return (hosts.find_this()->output_count != 0) == is_open;
    });
  }

  CabledRobot robot;
  const Host head = robot.head(source_model("300ms"));
  const Host base = robot.base(motor_model("300ms"));
  std::optional<Planner> planner{head};
  Body body{base};
};

using UnheardEnds = Cable;

TEST_F(UnheardEnds, OfAPublisherThatIsStartedAgainDoNotSpeakInItsPlace) {
  UnheardEnd one;
  for (int life = 0; life < 5; ++life) {
    const std::int64_t published = one.end_planner();
    one.planner.emplace(one.head, published);
    UnheardEnd::await_offer(true);
  }
  one.robot.cables.heal_to(kHead);
  one.body.drive(*one.planner);
}

TEST_F(UnheardEnds, LeaveTheSourceToAnotherHost) {
  UnheardEnd one;
  const NetworkNamespace rear_network;
  one.robot.cables.connect(rear_network, 3);
  const std::int64_t published = one.end_planner();
  one.robot.cables.heal_to(kHead);
  const std::string taken = "comes from host head";
  await([&] { return one.base.log().find(taken) != one.base.log().rfind(taken); });
  const Host rear = one.robot.host("rear", source_model("300ms"), rear_network);
  Planner other(rear, published);
  one.body.drive(other);
}

// The large sample waits for a receipt that does not come; what is said after it must not be lost.
TEST_F(Cable, ADeactivationBehindALargeSampleOutlivesACut) {
  CabledRobot robot;
  Host head = robot.head(source_model("forever"));
  Host base = robot.base(motor_model("forever"));
  Node brain = head.node("brain");
  auto planner = brain.output_port(kPlanner, Type::variable("robot/Cloud", 200'000));
  Node body = base.node("body");
  auto hold = body.output_port<Speed>(kHold);
  auto motor = body.input_port(kMotor);
  const std::vector<std::byte> cloud(200'000);
  await([&] {
    planner.publish(Bytes(cloud.data(), 8));
    return motor.wait_for(5ms).has_value();
  });
  robot.cables.cut(kHead);
  planner.publish(Bytes(cloud.data(), cloud.size()));
  planner.deactivate();
  robot.cables.heal(kHead);
  await([&] {
    hold.publish(Speed{0});
    const auto got = motor.wait_for(5ms);
    return got && got->source() == kHold;
  });
}

}  // namespace
}  // namespace arbiter::test
