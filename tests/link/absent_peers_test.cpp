// What --peer names need not be there: a machine that is off, or a name that nobody can look up
// now.
#include <arpa/inet.h>
#include <dds/ddsrt/retcode.h>
#include <dds/ddsrt/sockets.h>
#include <gtest/gtest.h>
#include <linux/sockios.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/dds/peer_watch.hpp"
#include "link/dds/host_search.hpp"
#include "shm/file_descriptor.hpp"
#include "tests/link/cabled_robot.hpp"
#include "tests/link/robot.hpp"
#include "tests/support/await.hpp"

namespace arbiter::test {
namespace {

constexpr std::uint32_t kDomain = 43;
constexpr int kDiscoveryPort = 18160;

// As Cyclone sends; false: the socket is full.
bool send_to(const shm::FileDescriptor& socket, const std::string& address, int port) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  ::inet_pton(AF_INET, address.c_str(), &to.sin_addr);
  std::array<char, 400> bytes{};
  iovec part{bytes.data(), bytes.size()};
  msghdr message{};
  message.msg_name = &to;
  message.msg_namelen = sizeof to;
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  ssize_t sent = 0;
  return ddsrt_sendmsg(socket.get(), &message, MSG_DONTWAIT, &sent) == DDS_RETCODE_OK;
}

// The kernel keeps what goes to them until it knows that they are not there.
TEST_F(Cable, WhatIsSaidToHostsThatAreOffIsNotInTheWayOfOthers) {
  Switch cables;
  const NetworkNamespace place;
  cables.connect(place, kHead);
  run_in(place, [] {
    link::HostSearch::of_process().begin(kDomain);
    const shm::FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    for (int each = 100; each < 100 + 4; ++each) {
      const std::string address = "10.77.0." + std::to_string(each);
      for (int i = 0; i < 300; ++i) {
        ASSERT_TRUE(send_to(socket, address, kDiscoveryPort + 2 * (i % 33)));
      }
    }
    int waiting = -1;
    ASSERT_EQ(::ioctl(socket.get(), SIOCOUTQ, &waiting), 0);
    EXPECT_EQ(waiting, 0);
    // Samples leave by the socket that Cyclone has for them.
    ASSERT_TRUE(send_to(socket, "10.77.0.100", kDiscoveryPort + 1));
    ASSERT_EQ(::ioctl(socket.get(), SIOCOUTQ, &waiting), 0);
    EXPECT_GT(waiting, 0);
  });
}

TEST_F(Cable, HostsFindEachOtherThoughOthersAreOff) {
  CabledRobot robot;
  for (const int each : {kHead, kBase}) robot.cables.drop_multicast_to(each);
  std::vector<std::string> arguments = CabledRobot::arguments();
  for (const int each : {kHead, kBase, 100, 101, 102, 103, 104, 105}) {
    arguments.insert(arguments.end(), {"--peer", "10.77.0." + std::to_string(each)});
  }
  Host head("head", robot.runtime, source_model("300ms"), arguments, robot.head_network.enter());
  Host base("base", robot.runtime, motor_model("300ms"), arguments, robot.base_network.enter());
  Planner planner(head);
  Body body(base);
  for (int i = 0; i < 100; ++i) body.drive(planner);
}

// What a service tells systemd.
class NotifySocket {
 public:
  explicit NotifySocket(std::string path)
      : path_(std::move(path)), socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(socket_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string take() const {
    std::array<char, 100> bytes{};
    const ssize_t size = ::recv(socket_.get(), bytes.data(), bytes.size(), 0);
    return {bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0))};
  }

 private:
  const std::string path_;
  const shm::FileDescriptor socket_;
};

// Else systemd would start the link again and again. Where nobody is asked it is seen twice until
// it has joined: before it looks for its daemon, and before it joins.
TEST_F(Cable, ALinkIsSeenToRunWhileANameServerDoesNotAnswer) {
  CabledRobot robot;
  robot.base_network.ip("route add default via 10.77.0.200");
  const NotifySocket systemd(robot.runtime.path() + "/notify");
  const std::string servers = robot.runtime.path() + "/resolv.conf";
  std::ofstream(servers) << "nameserver 192.0.2.1\noptions timeout:1 attempts:2\n";
  std::vector<std::string> by = robot.base_network.enter();
  by.insert(by.end(), {"/usr/bin/unshare", "-m", "/bin/sh", "-c",
                       "mount --bind " + servers +
                           " /etc/resolv.conf && NOTIFY_SOCKET=" + systemd.path() + " exec \"$@\"",
                       "sh"});
  std::vector<std::string> arguments = CabledRobot::arguments();
  arguments.insert(arguments.end(), {"--peer", "head.example"});
  const Host base("base", robot.runtime, kNoRules, arguments, by);
  int seen = 0;
  for (bool is_joined = false; !is_joined;) {
    const bool is_seen = systemd.take() == "WATCHDOG=1";
    is_joined = base.log().find("host base, on eth0") != std::string::npos;
    seen += is_seen && !is_joined ? 1 : 0;
  }
  EXPECT_GT(seen, 2) << base.log();
  EXPECT_NE(base.log().find("cannot be found out now"), std::string::npos) << base.log();
}

// A robot's router may be up later than its hosts: neither of them has found the other's name.
TEST_F(Cable, ANameThatGetsAnAddressLaterIsLookedUpAgain) {
  CabledRobot robot;
  for (const int each : {kHead, kBase}) robot.cables.drop_multicast_to(each);
  const std::string servers = robot.runtime.path() + "/resolv.conf";
  std::ofstream(servers) << "nameserver 192.0.2.1\noptions timeout:1 attempts:1\n";
  // `hosts`: what it has in place of /etc/hosts.
  const auto start = [&](const std::string& name, const std::string& model,
                         const NetworkNamespace& network, const std::string& hosts) {
    std::ofstream(hosts) << "127.0.0.1 localhost\n";
    std::vector<std::string> by = network.enter();
    by.insert(by.end(), {"/usr/bin/unshare", "-m", "/bin/sh", "-c",
                         "mount --bind " + servers + " /etc/resolv.conf && mount --bind " + hosts +
                             " /etc/hosts && exec \"$@\"",
                         "sh"});
    std::vector<std::string> arguments = CabledRobot::arguments();
    arguments.insert(arguments.end(), {"--peer", "other.example"});
    return std::make_unique<Host>(name, robot.runtime, model, arguments, by);
  };
  const std::string hosts = robot.runtime.path() + "/hosts";
  const auto head = start("head", source_model("300ms"), robot.head_network, hosts);
  const auto base =
      start("base", motor_model("300ms"), robot.base_network, robot.runtime.path() + "/others");
  for (const auto* const each : {head.get(), base.get()}) each->see(", on eth0");
  std::ofstream(hosts) << "10.77.0.2 other.example\n";
  head->see("--peer other.example has the address 10.77.0.2 now: joining the network again");
  Planner planner(*head);
  Body body(*base);
  body.drive(planner);
}

TEST(PeerAddresses, ChangeWhereNoneOfThoseIsLeftThatThereWere) {
  gateway::dds::PeerAddresses peers;
  peers.note("base", {"10.0.0.1", "10.0.0.2"}, 0);
  EXPECT_EQ(peers.change(1), "");
  peers.note("base", {"10.0.0.2", "10.0.0.3"}, 0);
  EXPECT_EQ(peers.change(1), "");
  peers.note("base", {"10.0.0.3"}, 0);
  EXPECT_EQ(peers.change(1), "base has the address 10.0.0.3 now");
  peers.accept(1);
  EXPECT_EQ(peers.change(60'000'000'001), "");
}

TEST(PeerAddresses, AreThoseOfBeforeWhereNobodyKnowsThemNow) {
  gateway::dds::PeerAddresses peers;
  peers.note("base", {"10.0.0.1"}, 0);
  peers.note("base", {}, 0);
  peers.accept(1);
  peers.note("base", {"10.0.0.1"}, 0);
  EXPECT_EQ(peers.change(1), "");
}

TEST(PeerAddresses, AreNewWhereThereWereNone) {
  gateway::dds::PeerAddresses peers;
  peers.note("base", {}, 0);
  EXPECT_EQ(peers.change(1), "");
  peers.note("base", {"10.0.0.1"}, 0);
  EXPECT_EQ(peers.change(1), "base has the address 10.0.0.1 now");
}

// A name server that has answered before may be silent while DDS joins, and answer again later.
TEST(PeerAddresses, AreNewWhereDdsHasFoundNone) {
  gateway::dds::PeerAddresses peers;
  peers.note("base", {"10.0.0.1"}, 0);
  peers.accept(1);
  EXPECT_EQ(peers.change(1), "");
  peers.note_unknown("base");
  EXPECT_EQ(peers.change(1), "base has the address 10.0.0.1 now");
  peers.note_unknown("head");  // nobody has looked it up yet
  EXPECT_EQ(peers.change(1), "base has the address 10.0.0.1 now");
  peers.accept(1);
  peers.note("head", {"10.0.0.2"}, 0);
  EXPECT_EQ(peers.change(60'000'000'001), "head has the address 10.0.0.2 now");
}

// Each time the link joins its network again, and is silent for a while.
TEST(PeerAddresses, ChangeOnceAMinuteAtMost) {
  gateway::dds::PeerAddresses peers;
  peers.note("base", {"10.0.0.1"}, 0);
  peers.accept(1);
  peers.note("base", {"10.0.0.2"}, 0);
  EXPECT_NE(peers.change(2), "");
  peers.accept(2);
  peers.note("base", {"10.0.0.3"}, 0);
  EXPECT_EQ(peers.change(60'000'000'001), "");
  EXPECT_NE(peers.change(60'000'000'002), "");
}

// A name server may tell one of several addresses at a time, in turn. One that has only changed is
// not looked for any more.
TEST(PeerAddresses, AreAllThatANameHasLedToLatelyOnceItLeadsBack) {
  using Addresses = std::set<std::string>;
  constexpr shm::Nanoseconds kSecond = 1'000'000'000;
  gateway::dds::PeerAddresses peers;
  const auto join_for = [&](const std::string& address, shm::Nanoseconds now) {
    peers.note("base", {address}, now);
    EXPECT_EQ(peers.change(now), "base has the address " + address + " now");
    peers.accept(now);
    return peers.known("base");
  };
  peers.note("base", {"10.0.0.1"}, 0);
  peers.accept(0);
  EXPECT_EQ(join_for("10.0.0.2", 60 * kSecond), (Addresses{"10.0.0.2"}));
  EXPECT_EQ(join_for("10.0.0.1", 120 * kSecond), (Addresses{"10.0.0.1", "10.0.0.2"}));
  for (int i = 0; i < 10; ++i) {
    const shm::Nanoseconds now = (200 + 5 * i) * kSecond;
    peers.note("base", {i % 2 == 0 ? "10.0.0.1" : "10.0.0.2"}, now);
    EXPECT_EQ(peers.change(now), "");
  }
  const shm::Nanoseconds later = 300 * kSecond + gateway::dds::PeerAddresses::kRemembered;
  EXPECT_EQ(join_for("10.0.0.3", later), (Addresses{"10.0.0.3"}));
  EXPECT_EQ(join_for("10.0.0.4", later + 60 * kSecond), (Addresses{"10.0.0.4"}));
}

// A name server that has answered may be silent when DDS joins again.
TEST(PeerAddresses, TakeThePlaceOfNamesOnceTheyAreKnown) {
  const std::vector<std::string> peers{"localhost:7410", "10.0.0.1:7410", "nobody.invalid"};
  gateway::dds::PeerWatch watch(peers);
  std::vector<std::string> given;
  await([&] {
    given = watch.accept(peers);
    return given.front() != peers.front();
  });
  EXPECT_EQ(given, (std::vector<std::string>{"127.0.0.1:7410", "10.0.0.1:7410", "nobody.invalid"}));
}

TEST(PeerAddresses, AreOfNamesAlone) {
  EXPECT_EQ(gateway::dds::name_of_peer("10.0.0.1"), "");
  EXPECT_EQ(gateway::dds::name_of_peer("10.0.0.1:7410"), "");
  EXPECT_EQ(gateway::dds::name_of_peer("base.local:7410"), "base.local");
}

}  // namespace
}  // namespace arbiter::test
