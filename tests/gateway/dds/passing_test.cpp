// Samples of strangers, through the gateway and Arbiter, to other strangers.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <string>

#include <arbiter/arbiter.hpp>

#include "tests/gateway/dds/scene.hpp"

namespace arbiter::test {
namespace {

struct Vendors {
  const char* from;
  const char* to;
};

// Without it tests would be named by addresses.
void PrintTo(const Vendors& vendors, std::ostream* out) {
  *out << vendors.from << " to " << vendors.to;
}

class DdsPassing : public ::testing::TestWithParam<Vendors> {};

INSTANTIATE_TEST_SUITE_P(Vendors, DdsPassing,
                         ::testing::Values(Vendors{"cyclone", "cyclone"},
                                           Vendors{"cyclone", "fast"}, Vendors{"fast", "cyclone"},
                                           Vendors{"fast", "fast"}),
                         [](const auto& each) {
                           return std::string(each.param.from) + "_to_" + each.param.to;
                         });

TEST_P(DdsPassing, ATwistOfRos2PassesWithAllItsNumbers) {
  Drive drive("1000s", GetParam().from, GetParam().to, "");
  for (const char* const numbers : {"0.25 -1.5", "0.5 0.125"}) {
    drive.from.publish(numbers);
    EXPECT_EQ(drive.to.next_line(), std::string("sample ") + numbers);
  }
}

std::string twist_bytes(char encoding, double forward) {
  std::string bytes{'\0', encoding, '\0', '\0'};
  for (const double number : {forward, 0.0, 0.0, 0.0, 0.0, 0.0}) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
  }
  return bytes;
}

TEST_P(DdsPassing, WhileNobodyCommandsTheSampleOfAFileIsSent) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1000s"));
  std::ofstream(daemon.directory() + "/crawl.bin") << twist_bytes('\1', 0.125);
  const DdsGateway gateway(daemon, domain, kBaseOut + R"( idle="file:crawl.bin"/>)");
  Stranger base(GetParam().to, domain, {"sub", "twist", "rt/cmd_vel"});
  base.await("sample 0.125 0");
}

TEST_P(DdsPassing, WhoComesLaterIsGivenTheLastSampleOfALatchedTopic) {
  Drive drive("1000s", GetParam().from, GetParam().to, R"( qos="latched")");
  publish_until_heard(drive.from, drive.to, "1 0");
  Stranger late(GetParam().to, drive.domain,
                {"sub", "twist", "rt/cmd_vel", "durability=transient_local"});
  late.await("sample 1 0");
}

// As a component of ours writes it; Fast DDS 2.9 does not read it.
TEST(DdsRepresentation, ASampleOfXcdr2GoesOutAndOneOfXcdr1IsRefused) {
  const OwnDomain domain;
  Daemon daemon(base_model("1000s"));
  const DdsGateway gateway(daemon, domain, kBaseOut + R"( representation="xcdr2"/>)");
  Stranger base("cyclone", domain, {"sub", "twist", "rt/cmd_vel"});
  base.await("matched 1");
  gateway.see("1 subscriber matched");
  Node node("navigation");
  auto navigation =
      node.output_port("/Nav/cmd_vel:o", Type::variable("geometry_msgs/msg/Twist", 64));
  const auto publish = [&](const std::string& bytes) {
    navigation.publish(Bytes(reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()));
  };
  publish(twist_bytes('\1', 1));
  await_described(daemon, "/Base/cmd_vel:i", "1 refused");
  publish(twist_bytes('\7', 2));
  EXPECT_EQ(base.next_line(), "sample 2 0");
}

// A component of ours that makes a mistake: the base's DDS would drop it, and the base go on.
TEST(DdsSize, WhatCannotBeATwistIsNotSentAndTheBaseIsTold) {
  const OwnDomain domain;
  Daemon daemon(base_model("1000s"));
  const DdsGateway gateway(daemon, domain, kBaseOut + R"( idle="zero"/>)");
  Stranger base("cyclone", domain, {"sub", "twist", "rt/cmd_vel"});
  base.await("matched 1");
  gateway.see("1 subscriber matched");
  Node node("navigation");
  auto navigation =
      node.output_port("/Nav/cmd_vel:o", Type::variable("geometry_msgs/msg/Twist", 64));
  const auto publish = [&](const std::string& bytes) {
    navigation.publish(Bytes(reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()));
  };
  publish(twist_bytes('\1', 1));
  base.await("sample 1 0");
  publish(twist_bytes('\1', 2).substr(0, 44));
  await_described(daemon, "/Base/cmd_vel:i",
                  "1 unreadable; the last bad sample has 44 bytes; geometry_msgs/msg/Twist has 52");
  EXPECT_EQ(base.next_line(), "sample 0 0");
  EXPECT_EQ(base.next_line(), "sample 0 0");
  publish(twist_bytes('\1', 3));
  base.await("sample 3 0");
}

TEST_P(DdsPassing, TheOneWhoOverridesIsObeyed) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1000s"));
  const DdsGateway gateway(daemon, domain, kNavIn + kTeleopIn + kBaseOut + "/>");
  Stranger base(GetParam().to, domain, {"sub", "twist", "rt/cmd_vel"});
  Stranger navigation(GetParam().from, domain, {"pub", "twist", "rt/cmd_vel_nav"});
  Stranger teleop(GetParam().from, domain, {"pub", "twist", "rt/cmd_vel_teleop"});
  base.await("matched 1");
  navigation.await("matched 1");
  teleop.await("matched 1");
  gateway.see("/Nav/cmd_vel:o comes from DDS topic rt/cmd_vel_nav, 1 publisher matched");
  gateway.see("/Teleop/cmd_vel:o comes from DDS topic rt/cmd_vel_teleop, 1 publisher matched");
  gateway.see("1 subscriber matched");
  navigation.publish("1 1");
  EXPECT_EQ(base.next_line(), "sample 1 1");
  teleop.publish("2 2");
  EXPECT_EQ(base.next_line(), "sample 2 2");
  navigation.publish("1 1");  // loses
  EXPECT_EQ(navigation.end(), 0);
  teleop.publish("3 3");
  EXPECT_EQ(base.next_line(), "sample 3 3");
}

// One source, one port.
std::string model_of(const std::string& source, const std::string& port) {
  return "<behaviors timeout=\"1000s\"><behavior name=\"Show\"><config at=\"" + port + "\">" +
         source + "</config></behavior></behaviors>";
}

std::string entries(const std::string& type, const std::string& max_size) {
  return R"(<in topic="incoming" type=")" + type + R"(" port="/From:o" max_size=")" + max_size +
         R"("/><out topic="outgoing" type=")" + type + R"(" port="/To:i" max_size="2MiB"/>)";
}

// The next line after those of `first`, which was published until it was heard: on a busy machine
// it may come again.
std::string line_after(Stranger& to, const std::string& first) {
  std::string line = to.next_line();
  while (line == "sample " + first) line = to.next_line();
  return line;
}

// Larger than a datagram: it arrives in fragments, which are put together in Arbiter's memory.
TEST_P(DdsPassing, ALargeSamplePassesWhole) {
  Passage blobs(model_of("/From:o", "/To:i"), entries("strangers::Blob", "2MiB"), GetParam().from,
                {"blob", "incoming"}, GetParam().to, {"blob", "outgoing"});
  const std::string first = "6 200000";
  publish_until_heard(blobs.from, blobs.to, first);
  blobs.from.publish("7 1000000");
  EXPECT_EQ(line_after(blobs.to, first), "sample 7 1000000");
  for (const char* const blob : {"8 3", "9 70001"}) {
    blobs.from.publish(blob);
    EXPECT_EQ(blobs.to.next_line(), std::string("sample ") + blob);
  }
}

// Without keyed="true" in the mapping: whoever is there says that the type has a key.
TEST_P(DdsPassing, ATypeWithAKeyPassesThoughTheMappingDoesNotSayThatItHasOne) {
  Passage robots(model_of("/From:o", "/To:i"), entries("strangers::Robot", "1KiB"), GetParam().from,
                 {"robot", "incoming"}, GetParam().to, {"robot", "outgoing"});
  for (const char* const robot : {"1 0.5", "2 0.25"}) {
    robots.from.publish(robot);
    EXPECT_EQ(robots.to.next_line(), std::string("sample ") + robot);
  }
}

// The next one is passed on as if they had not been.
TEST_P(DdsPassing, WhatDoesNotFitIsCountedAndPassedOver) {
  Passage blobs(model_of("/From:o", "/To:i"), entries("strangers::Blob", "1KiB"), GetParam().from,
                {"blob", "incoming"}, GetParam().to, {"blob", "outgoing"});
  const std::string first = "0 3";
  publish_until_heard(blobs.from, blobs.to, first);
  blobs.from.publish("1 5000");
  await_described(
      blobs.daemon, "/From:o",
      "1 of a size that does not fit; the last bad sample has 5012 bytes; max_size is 1024");
  blobs.from.publish("2 8000");
  await_described(blobs.daemon, "/From:o",
                  "2 of a size that does not fit; the last bad sample has 8012 bytes");
  blobs.from.publish("3 100");
  EXPECT_EQ(line_after(blobs.to, first), "sample 3 100");
}

// Cyclone waits by select(), for descriptors below 1024. Each port needs three.
TEST(DdsDescriptors, AreLeftForCycloneBesideHundredsOfTopics) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit more{std::min<rlim_t>(before.rlim_max, 8192), before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &more), 0);
  {
    const OwnDomain domain;
    const Daemon daemon(model_of("/In399:o", "/To:i"));
    std::string elements = R"(<out port="/To:i" topic="/cmd_vel" )" + kTwist + "/>";
    for (int i = 0; i < 400; ++i) {
      const std::string number = std::to_string(i);
      elements += "<in topic=\"/in" + number + "\" " + kTwist + " max_size=\"64\" port=\"/In" +
                  number + ":o\"/>";
    }
    DdsGateway gateway(daemon, domain, elements);
    gateway.see("serves 400 topics in, 1 out");
    Stranger to("cyclone", domain, {"sub", "twist", "rt/cmd_vel"});
    Stranger from("cyclone", domain, {"pub", "twist", "rt/in399"});
    to.await("matched 1");
    from.await("matched 1");
    gateway.see("1 publisher matched");
    gateway.see("1 subscriber matched");
    publish_until_heard(from, to, "1 0");
    EXPECT_EQ(gateway.end(), 0);
  }
  ::setrlimit(RLIMIT_NOFILE, &before);
}

// As iceoryx's: whoever has no descriptor for his loop ends.
TEST(DdsDescriptors, PortsForWhichThereAreNoneAreLeftOutAndTheOthersAreServed) {
  const OwnDomain domain;
  const Daemon daemon(model_of("/In:o", "/To:i"));
  std::string elements = R"(<out port="/To:i" topic="/cmd_vel" )" + kTwist + "/>" +
                         R"(<in topic="/in" )" + kTwist + R"( port="/In:o"/>)";
  for (int i = 0; i < 100; ++i) {
    const std::string number = std::to_string(i);
    elements += "<in topic=\"/in" + number + "\" " + kTwist + " max_size=\"64\" port=\"/In" +
                number + ":o\"/>";
  }
  DdsGateway gateway(daemon, domain, elements, "lo", "", {"/usr/bin/prlimit", "--nofile=256:256"});
  gateway.see("/In99:o is not served: no descriptors are left for it: raise RLIMIT_NOFILE");
  Stranger to("cyclone", domain, {"sub", "twist", "rt/cmd_vel"});
  const Stranger from("cyclone", domain, {"pub", "twist", "rt/in"});
  publish_until_heard(from, to, "1 0");
  EXPECT_EQ(gateway.end(), 0);
}

}  // namespace
}  // namespace arbiter::test
