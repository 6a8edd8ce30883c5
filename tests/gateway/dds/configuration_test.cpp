// What Cyclone is configured with.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/dds/dds_middleware.hpp"
#include "gateway/dds/domain.hpp"
#include "tests/gateway/dds/own_domain.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"

namespace arbiter::gateway::dds {
namespace {

using test::ScopedVariable;

TEST(DdsConfiguration, IsCyclonesOwnWhereTheMappingSaysNothing) {
  const ScopedVariable uri("CYCLONEDDS_URI", "file:///etc/robot.xml");
  EXPECT_EQ(configuration_of({}, ""), "file:///etc/robot.xml");
  const ScopedVariable none("CYCLONEDDS_URI", std::nullopt);
  EXPECT_EQ(configuration_of({}, ""), "");
}

TEST(DdsConfiguration, AFileOfTheMappingTakesThePlaceOfTheEnvironments) {
  const ScopedVariable uri("CYCLONEDDS_URI", "file:///etc/robot.xml");
  EXPECT_EQ(configuration_of({}, "/etc/arbiter/dds.xml"), "file:///etc/arbiter/dds.xml");
}

// Cyclone would listen on those of the environment, too.
TEST(DdsConfiguration, InterfacesAndPeersTakeThePlaceOfTheEnvironmentsAndStandBehindTheFiles) {
  const ScopedVariable uri("CYCLONEDDS_URI", "file:///etc/other.xml");
  Gateway gateway;
  gateway.interfaces = {"eth0", "10.0.0.2"};
  gateway.peers = {"10.0.0.7"};
  EXPECT_EQ(configuration_of(gateway, "/etc/robot.xml"),
            "file:///etc/robot.xml,<General><Interfaces><NetworkInterface name=\"eth0\"/>"
            "<NetworkInterface address=\"10.0.0.2\"/></Interfaces></General><Discovery>"
            "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32"
            "</MaxAutoParticipantIndex><Peers><Peer address=\"10.0.0.7\"/></Peers></Discovery>");
}

TEST(DdsConfiguration, OnTheLoopbackInterfaceParticipantsAreLookedForAtItsAddress) {
  const ScopedVariable uri("CYCLONEDDS_URI", std::nullopt);
  Gateway gateway;
  gateway.interfaces = {"lo"};
  const std::string text = configuration_of(gateway, "");
  EXPECT_NE(text.find("<AllowMulticast>false</AllowMulticast>"), std::string::npos);
  EXPECT_NE(text.find("<Peer address=\"127.0.0.1\"/>"), std::string::npos);
}

TEST(DdsConfiguration, NoNameBreaksOutOfItsPlace) {
  const ScopedVariable uri("CYCLONEDDS_URI", std::nullopt);
  Gateway gateway;
  gateway.interfaces = {R"(x"/><a b="${HOME})"};
  EXPECT_NE(configuration_of(gateway, "").find(R"(name="x&quot;/&gt;&lt;a b=&quot;&#36;{HOME}")"),
            std::string::npos);
}

// It is judged with the mapping; a gateway that joins later, or sends idle samples for one that has
// died, must not go by what somebody has written since.
TEST(DdsConfiguration, IsWhatStoodInTheFileWhenTheMappingWasRead) {
  const test::OwnDomain number;
  const Bell bell;
  Gateway gateway;
  gateway.domain = number.number();
  gateway.interfaces = {"lo"};
  gateway.configuration = "/nowhere/dds.xml";
  gateway.configuration_text = "<CycloneDDS/>";
  EXPECT_NO_THROW(Domain(gateway, {}, bell));
  gateway.configuration_text = "<CycloneDDS><Domain><Nonsense/></Domain></CycloneDDS>";
  hear_cyclone();
  const CycloneWords words;
  EXPECT_THROW(Domain(gateway, {}, bell), DdsError);
  EXPECT_THAT(words.last(),
              ::testing::AllOf(::testing::HasSubstr("Nonsense: unknown element"),
                               ::testing::HasSubstr("file:///nowhere/dds.xml line 1")));
}

// With it Cyclone would wait for iceoryx's RouDi, and end the gateway when none comes.
TEST(DdsConfiguration, WhateverItSaysCyclonesSharedMemoryStaysOff) {
  const test::OwnDomain number;
  const Bell bell;
  const char* const with_it =
      "<CycloneDDS><Domain><SharedMemory><Enable>true</Enable></SharedMemory></Domain></"
      "CycloneDDS>";
  const ScopedVariable uri("CYCLONEDDS_URI", with_it);
  Gateway gateway;
  gateway.domain = number.number();
  EXPECT_NO_THROW(Domain(gateway, {}, bell));
  gateway.interfaces = {"lo"};
  gateway.configuration = "/nowhere/dds.xml";
  gateway.configuration_text = with_it;
  EXPECT_NO_THROW(Domain(gateway, {}, bell));
}

// Cyclone closes what the end leaves open.
TEST(DdsConfiguration, OfTheEnvironmentMayLeaveElementsOpen) {
  const test::OwnDomain number;
  const Bell bell;
  const ScopedVariable uri("CYCLONEDDS_URI",
                           "<Tracing><OutputFile>stderr</OutputFile><Verbosity>warning");
  Gateway gateway;
  gateway.domain = number.number();
  EXPECT_NO_THROW(Domain(gateway, {}, bell));
}

TEST(DdsDomain, IsTheMappingsOrThatOfRos2) {
  const ScopedVariable ros("ROS_DOMAIN_ID", "42");
  Gateway gateway;
  EXPECT_EQ(domain_of(gateway), 42U);
  gateway.domain = 7;
  EXPECT_EQ(domain_of(gateway), 7U);
  const ScopedVariable none("ROS_DOMAIN_ID", std::nullopt);
  EXPECT_EQ(domain_of({}), 0U);
  for (const char* const wrong : {"x", "7x", "-1", "231", "99999999999"}) {
    const ScopedVariable bad("ROS_DOMAIN_ID", wrong);
    EXPECT_THROW(static_cast<void>(domain_of({})), DdsError) << wrong;
  }
}

// The mapping's check does not know the environment.
TEST(DdsDomain, OfTheEnvironmentIsNoWayPastTheGateway) {
  const ScopedVariable ros("ROS_DOMAIN_ID", "7");
  const auto entry = [](Entry::Direction direction, std::vector<std::string> partitions) {
    Entry result;
    result.direction = direction;
    result.dds.emplace().name = "rt/cmd_vel";
    result.dds->qos.partitions = std::move(partitions);
    return result;
  };
  Mapping mapping;
  mapping.gateways.resize(2);
  mapping.gateways[0].entries = {entry(Entry::Direction::kOut, {})};
  mapping.gateways[1].domain = 7;
  mapping.gateways[1].entries = {entry(Entry::Direction::kIn, {})};
  const Bell bell;
  LatchedSamples latched;
  EXPECT_NE(test::error_of([&] {
              DdsMiddleware({mapping}, bell, latched);
            }).find("comes in and goes out within DDS domain 7"),
            std::string::npos);
  mapping.gateways[1].domain = 8;
  EXPECT_NO_THROW(DdsMiddleware({mapping}, bell, latched));
  mapping.gateways[1].domain = 7;
  mapping.gateways[1].entries = {entry(Entry::Direction::kIn, {"raw"})};
  EXPECT_NO_THROW(DdsMiddleware({mapping}, bell, latched));
}

}  // namespace
}  // namespace arbiter::gateway::dds
