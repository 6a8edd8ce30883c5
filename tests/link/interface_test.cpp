// The interface by which a link reaches the other hosts: it comes late, goes, changes its address,
// or can do no multicast.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <functional>
#include <string>
#include <vector>

#include "link/dds/network.hpp"
#include "link/interface_watch.hpp"
#include "tests/client/models.hpp"
#include "tests/link/cabled_robot.hpp"
#include "tests/link/known_hosts.hpp"
#include "tests/link/robot.hpp"
#include "wire/link_call.hpp"

namespace arbiter::test {
namespace {

TEST_F(Cable, AnInterfaceMayComeAfterTheLink) {
  CabledRobot robot;
  const NetworkNamespace late;
  Host base = robot.base(motor_model("300ms"));
  Host rear = robot.host("rear", kNoRules, late);
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
  Host head = robot.head(source_model("300ms"));
  Host base = robot.base(motor_model("300ms"));
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

// As a second cable may.
TEST_F(Cable, OneOfTwoInterfacesMayGoAndComeBack) {
  CabledRobot robot;
  const auto plug_in = [&] {
    robot.head_network.ip("link add eth1 type veth peer name other1");
    robot.head_network.ip("addr add 10.78.0.1/24 dev eth1");
    for (const std::string each : {"eth1", "other1"}) {
      robot.head_network.ip("link set " + each + " up");
    }
  };
  plug_in();
  const std::vector<std::string> both{"--interface", "eth0", "--interface", "eth1"};
  Host head("head", robot.runtime, source_model("300ms"), both, robot.head_network.enter());
  Host base = robot.base(motor_model("300ms"));
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  head.see("host head, on eth0, eth1\n");
  robot.head_network.ip("link del eth1");
  head.see("host head, on eth0 alone: of eth0, eth1 (--interface), the rest is not there now");
  body.drive(planner);
  plug_in();
  head.see("the network interface eth1 has the address 10.78.0.1 now: joining the network again");
  body.drive(planner);
}

// Its address stays where it is.
TEST_F(Cable, OneOfTwoInterfacesMayBeDown) {
  CabledRobot robot;
  robot.head_network.ip("link add eth1 type veth peer name other1");
  robot.head_network.ip("addr add 10.78.0.1/24 dev eth1");
  robot.head_network.ip("link set other1 up");
  const std::vector<std::string> both{"--interface", "eth0", "--interface", "eth1"};
  Host head("head", robot.runtime, source_model("300ms"), both, robot.head_network.enter());
  Host base = robot.base(motor_model("300ms"));
  head.see(
      "host head, on eth0 alone: of eth0, eth1 (--interface), the rest is not there now, is "
      "down");
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  robot.head_network.ip("link set eth1 up");
  head.see("host head, on eth0, eth1\n");
  body.drive(planner);
}

// Who switches all hosts is told of one that is gone, whatever this link has been through since.
TEST_F(Cable, ALinkThatJoinsAgainRemembersWhoIsGone) {
  CabledRobot robot;
  Host head = robot.head(kNoRules);
  Host base = robot.base(kNoRules);
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
  Host base = robot.base(motor_model("300ms"));
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
  run_in(place, [&] {
    const link::Network network({43, {"eth0"}, {}});
    place.ip("addr flush dev eth0");
  });
}

// Whoever changes interfaces all the time must not keep a link from joining: what is left over is
// heard afterwards, and the link joins once more.
TEST_F(Cable, OfManyChangesALinkHearsSomeBeforeItJoins) {
  Switch cables;
  const NetworkNamespace place;
  cables.connect(place, kHead);
  run_in(place, [&] {
    link::InterfaceWatch watch({"eth0"});
    for (int i = 0; i < 50; ++i) {
      place.ip("addr del 10.77.0.1/24 dev eth0");
      place.ip("addr add 10.77.0.1/24 dev eth0");
    }
    watch.begin();
    EXPECT_EQ(watch.missing(), "");
    EXPECT_EQ(watch.change(), "a network interface was gone");
    EXPECT_EQ(watch.change(), "");
  });
}

TEST_F(Cable, AChangeForWhichNoDescriptorWasLeftIsLookedIntoLater) {
  Switch cables;
  const NetworkNamespace place;
  cables.connect(place, kHead);
  run_in(place, [&] {
    link::InterfaceWatch watch({"eth0"});
    watch.begin();
    place.ip("addr del 10.77.0.1/24 dev eth0");
    place.ip("addr add 10.77.0.9/24 dev eth0");
    rlimit usual{};
    ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &usual), 0);
    const rlimit none{0, usual.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &none), 0);
    EXPECT_EQ(watch.change(), "");
    ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &usual), 0);
    EXPECT_EQ(watch.change(), "the network interface eth0 has the address 10.77.0.9 now");
    EXPECT_EQ(watch.change(), "");
  });
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
