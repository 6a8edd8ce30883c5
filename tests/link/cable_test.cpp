// Rules 3, 4 and 5 of docs/hosts.md: two hosts with networks of their own, and the cable between
// them pulled. That is silence; what has waited is late; and the last state gets through.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>

#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "link/dds/network.hpp"
#include "shm/file_descriptor.hpp"
#include "tests/client/models.hpp"
#include "tests/link/cables.hpp"
#include "tests/link/known_hosts.hpp"
#include "tests/link/robot.hpp"
#include "wire/link_call.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

constexpr int kHead = 1;
constexpr int kBase = 2;
constexpr int kUnheard = 100;  // samples that are published during a cut

class Cable : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = why_no_networks(); !why.empty()) GTEST_SKIP() << why;
  }
};

// All of a robot, made once it is known that it can be.
struct CabledRobot {
  CabledRobot() {
    cables.connect(head_network, kHead);
    cables.connect(base_network, kBase);
  }
  [[nodiscard]] static std::vector<std::string> arguments() { return {"--interface", "eth0"}; }

  Switch cables;
  NetworkNamespace head_network;
  NetworkNamespace base_network;
  TemporaryDirectory runtime;
};

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
  Host head("head", robot.runtime, source_model("300ms"), robot.arguments(),
            robot.head_network.enter());
  Host base("base", robot.runtime, motor_model("300ms"), robot.arguments(),
            robot.base_network.enter());
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
  Host head("head", robot.runtime, source_model("forever"), robot.arguments(),
            robot.head_network.enter());
  Host base("base", robot.runtime, motor_model("forever"), robot.arguments(),
            robot.base_network.enter());
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
  Host head("head", robot.runtime, source_model("300ms"), robot.arguments(),
            robot.head_network.enter());
  Host base("base", robot.runtime, motor_model("300ms"), robot.arguments(),
            robot.base_network.enter());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  Host rear("rear", robot.runtime, source_model("300ms"), robot.arguments(), rear_network.enter());
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
  [[nodiscard]] Host host(const std::string& name, const std::string& model,
                          const NetworkNamespace& network) const {
    return {name, robot.runtime, model, CabledRobot::arguments(), network.enter()};
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
  const Host head = host("head", source_model("300ms"), robot.head_network);
  const Host base = host("base", motor_model("300ms"), robot.base_network);
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
  const Host rear = one.host("rear", source_model("300ms"), rear_network);
  Planner other(rear, published);
  one.body.drive(other);
}

// The large sample waits for a receipt that does not come; what is said after it must not be lost.
TEST_F(Cable, ADeactivationBehindALargeSampleOutlivesACut) {
  CabledRobot robot;
  Host head("head", robot.runtime, source_model("forever"), robot.arguments(),
            robot.head_network.enter());
  Host base("base", robot.runtime, motor_model("forever"), robot.arguments(),
            robot.base_network.enter());
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

TEST_F(Cable, AnInterfaceMayComeAfterTheLink) {
  CabledRobot robot;
  const NetworkNamespace late;
  Host base("base", robot.runtime, motor_model("300ms"), robot.arguments(),
            robot.base_network.enter());
  Host rear("rear", robot.runtime, kNoRules, robot.arguments(), late.enter());
  rear.see("this machine has no interface eth0 (--interface), but lo; trying again");
  await_hosts("rear", [](const auto& hosts) { return hosts.find_this()->has_daemon; });
  robot.cables.connect(late, 3);
  Planner planner(rear);
  Body body(base);
  body.drive(planner);
  base.await_described(kPlanner, "host rear");
}

// What happens to the network of the head, while its planner commands the motor on the base; then
// it commands again.
void change_network(const std::function<void(CabledRobot&)>& change, const std::string& said) {
  CabledRobot robot;
  Host head("head", robot.runtime, source_model("300ms"), robot.arguments(),
            robot.head_network.enter());
  Host base("base", robot.runtime, motor_model("300ms"), robot.arguments(),
            robot.base_network.enter());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  change(robot);
  if (!said.empty()) head.see(said);
  body.drive(planner);
  // And in the other direction.
  Node node = base.node("sensor");
  auto sensor = node.output_port<Speed>("/Sensor/speed:o");
  head.daemon().load(rules(arbiter_at("/Display/speed:i", select("/Sensor/speed:o"))));
  Node display = head.node("display");
  auto in = display.input_port<Speed>("/Display/speed:i");
  await([&] {
    sensor.publish(Speed{1});
    return in.wait_for(5ms).has_value();
  });
}

void give_address(const std::string& address) {
  change_network(
      [&](CabledRobot& robot) {
        robot.head_network.ip("addr del 10.77.0.1/24 dev eth0");
        robot.head_network.ip("addr add " + address + " dev eth0");
      },
      "joining the network again");
}

TEST_F(Cable, AnotherAddressOfTheInterfaceIsNoticed) { give_address("10.77.0.11/24"); }

// Perhaps before anybody has looked.
TEST_F(Cable, AnAddressThatWasGoneForAMomentIsNoticed) { give_address("10.77.0.1/24"); }

TEST_F(Cable, AnInterfaceThatGoesAndComesBackIsUsedAgain) {
  change_network(
      [](CabledRobot& robot) {
        robot.head_network.ip("link del eth0");
        robot.cables.connect(robot.head_network, kHead);
      },
      "joining the network again");
}

// Who switches all hosts is told of one that is gone, whatever this link has been through since.
TEST_F(Cable, ALinkThatJoinsAgainRemembersWhoIsGone) {
  CabledRobot robot;
  Host head("head", robot.runtime, kNoRules, robot.arguments(), robot.head_network.enter());
  Host base("base", robot.runtime, kNoRules, robot.arguments(), robot.base_network.enter());
  const auto is_base = [](wire::HostOutcome outcome) {
    try {
      for (const auto& each : wire::LinkCall("head").ask_hosts({wire::kAllHosts, "model"})) {
        if (each.host == "base") return each.outcome == outcome;
      }
    } catch (const wire::CallError&) {  // the link joins just now
    }
    return false;
  };
  await([&] { return is_base(wire::HostOutcome::kAnswered); });
  base.link().signal(SIGTERM);
  EXPECT_EQ(base.link().wait(), 0);
  await([&] { return is_base(wire::HostOutcome::kGone); });
  robot.head_network.ip("addr del 10.77.0.1/24 dev eth0");
  head.see("trying again");
  robot.head_network.ip("addr add 10.77.0.1/24 dev eth0");
  await_hosts("head", [](const auto& hosts) { return hosts.network.has_value(); });
  await([&] { return is_base(wire::HostOutcome::kGone); });
}

// Cyclone's threads wait for datagrams that cannot come any more.
TEST_F(Cable, ALinkWhoseAddressIsGoneEndsAllTheSame) {
  CabledRobot robot;
  Host base("base", robot.runtime, motor_model("300ms"), robot.arguments(),
            robot.base_network.enter());
  base.see("host base, on eth0");
  robot.base_network.ip("addr del 10.77.0.2/24 dev eth0");
  base.link().signal(SIGTERM);
  EXPECT_EQ(base.link().wait(), 0);
}

TEST_F(Cable, AnInterfaceThatIsSwitchedOffAndOnIsUsedAgain) {
  change_network(
      [](CabledRobot& robot) {
        robot.head_network.ip("link set eth0 down");
        robot.head_network.ip("link set eth0 up");
      },
      "");
}

// Cyclone ends its threads by sending to its own address, which is gone: nobody has noticed yet.
TEST_F(Cable, ANetworkEndsThoughItsAddressGoesJustThen) {
  Switch cables;
  const NetworkNamespace place;
  cables.connect(place, kHead);
  std::thread thread([&] {
    const shm::FileDescriptor there(
        ::open(("/proc/" + place.pid() + "/ns/net").c_str(), O_RDONLY | O_CLOEXEC));
    ASSERT_EQ(::setns(there.get(), CLONE_NEWNET), 0);  // of this thread, and of those it makes
    const link::Network network({43, {"eth0"}, {}});
    place.ip("addr flush dev eth0");
  });
  thread.join();
}

void drive_by_peers(const CabledRobot& robot, const std::vector<int>& peers_of_head,
                    const std::vector<int>& peers_of_base) {
  const auto arguments_to = [](const std::vector<int>& peers) {
    std::vector<std::string> all = CabledRobot::arguments();
    for (const int peer : peers) {
      all.insert(all.end(), {"--peer", "10.77.0." + std::to_string(peer)});
    }
    return all;
  };
  Host head("head", robot.runtime, source_model("300ms"), arguments_to(peers_of_head),
            robot.head_network.enter());
  Host base("base", robot.runtime, motor_model("300ms"), arguments_to(peers_of_base),
            robot.base_network.enter());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  base.await_described(kPlanner, "host head");
}

// The interfaces could do multicast, but the switch passes none on.
TEST_F(Cable, PeersThatNameEachOtherNeedNoMulticast) {
  CabledRobot robot;
  for (const int each : {kHead, kBase}) robot.cables.drop_multicast_to(each);
  drive_by_peers(robot, {kBase}, {kHead});
}

// A link whose interface cannot do multicast listens where peers look for it, though it names none.
void drive_by_one_peer(const std::vector<int>& of_head, const std::vector<int>& of_base) {
  CabledRobot robot;
  for (const NetworkNamespace* each : {&robot.head_network, &robot.base_network}) {
    each->ip("link set eth0 multicast off");
  }
  drive_by_peers(robot, of_head, of_base);
}

TEST_F(Cable, WhereInterfacesHaveNoMulticastTheExporterMayNameItsPeer) {
  drive_by_one_peer({kBase}, {});
}

TEST_F(Cable, WhereInterfacesHaveNoMulticastTheImporterMayNameItsPeer) {
  drive_by_one_peer({}, {kHead});
}

}  // namespace
}  // namespace arbiter::test
