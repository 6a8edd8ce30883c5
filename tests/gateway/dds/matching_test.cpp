// Who does not match is named, with the reason; who would bypass Arbiter, too.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/dds/entity.hpp"
#include "gateway/dds/opaque_type.hpp"
#include "tests/gateway/dds/scene.hpp"

namespace arbiter::test {
namespace {

class DdsMatching : public ::testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Vendors, DdsMatching, ::testing::Values("cyclone", "fast"),
                         [](const auto& each) { return std::string(each.param); });

TEST_P(DdsMatching, ABestEffortPublisherDoesNotMatchAReliableEntryAndIsNamedWithBothValues) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1s"));
  const DdsGateway gateway(daemon, domain, kNavIn);
  const Stranger navigation(GetParam(), domain,
                            {"pub", "twist", "rt/cmd_vel_nav", "reliability=best_effort"});
  gateway.see(
      "does not match: reliability: the writer offers best_effort, this entry asks for reliable; "
      "write reliability=\"best_effort\"");
}

TEST_P(DdsMatching, ItMatchesOnceTheEntrySaysWhatTheMessageSays) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1s"));
  const DdsGateway gateway(daemon, domain,
                           R"(<in topic="/cmd_vel_nav" )" + kTwist +
                               R"( port="/Nav/cmd_vel:o" reliability="best_effort"/>)");
  Stranger navigation(GetParam(), domain,
                      {"pub", "twist", "rt/cmd_vel_nav", "reliability=best_effort"});
  navigation.await("matched 1");
  gateway.see("1 publisher matched");
}

TEST_P(DdsMatching, ALateJoinerThatAsksForWhatWasThereBeforeIsNamed) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1s"));
  const DdsGateway gateway(daemon, domain, kBaseOut + "/>");
  const Stranger base(GetParam(), domain,
                      {"sub", "twist", "rt/cmd_vel", "durability=transient_local"});
  gateway.see(
      "does not match: durability: this entry offers volatile, the reader asks for "
      "transient_local; write durability=\"transient_local\"");
}

TEST_P(DdsMatching, ADeadlineThatIsTooLongIsNamed) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1s"));
  const DdsGateway gateway(
      daemon, domain,
      R"(<in topic="/cmd_vel_nav" )" + kTwist + R"( port="/Nav/cmd_vel:o" deadline="100ms"/>)");
  const Stranger navigation(GetParam(), domain, {"pub", "twist", "rt/cmd_vel_nav", "deadline=200"});
  gateway.see("does not match: deadline: the writer offers 200 ms, this entry asks for 100 ms");
}

TEST_P(DdsMatching, AnotherTypeIsNamedWithBothNames) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1s"));
  const DdsGateway gateway(daemon, domain, kNavIn);
  const Stranger navigation(GetParam(), domain, {"pub", "bool", "rt/cmd_vel_nav"});
  gateway.see(
      "does not match: type: it has std_msgs/msg/Bool, this entry has geometry_msgs/msg/Twist; if "
      "its type is right, write type=\"std_msgs/msg/Bool\"");
}

TEST_P(DdsMatching, AKeyThatTheMappingDeniesIsNamed) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1s"));
  const DdsGateway gateway(
      daemon, domain,
      R"(<in topic="robots" type="strangers::Robot" port="/Fleet/robot:o" keyed="false"/>)");
  const Stranger robot(GetParam(), domain, {"pub", "robot", "robots"});
  gateway.see("key: its type has a key, this entry's has none; write keyed=\"true\"");
}

TEST_P(DdsMatching, PartitionsKeepTopicsApartAndJoinThem) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1000s"));
  const DdsGateway gateway(daemon, domain,
                           R"(<in topic="/cmd_vel" )" + kTwist +
                               R"( port="/Nav/cmd_vel:o" partition="raw"/>)" + kBaseOut + "/>");
  Stranger base(GetParam(), domain, {"sub", "twist", "rt/cmd_vel"});
  Stranger navigation(GetParam(), domain, {"pub", "twist", "rt/cmd_vel", "partition=raw"});
  base.await("matched 1");
  navigation.await("matched 1");
  gateway.see("1 publisher matched");
  gateway.see("1 subscriber matched");
  navigation.publish("4 2");
  EXPECT_EQ(base.next_line(), "sample 4 2");
  // Neither end warns of the other's partition, nor is the publisher a foreign one of the topic
  // out.
  EXPECT_THAT(gateway.log(), ::testing::Not(::testing::HasSubstr("past Arbiter")));
}

// Nor does one of another partition decide whether the entry's end has a key.
TEST_P(DdsMatching, AKeyIsThatOfWhoMayMatch) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1s"));
  const DdsGateway gateway(daemon, domain,
                           R"(<in topic="robots" type="strangers::Robot" port="/Fleet/robot:o"/>)");
  const Stranger other(GetParam(), domain, {"pub", "robot", "robots", "partition=raw"});
  gateway.see("does not match: key: its type has a key, this entry's has none");
  const Stranger robot(GetParam(), domain, {"pub", "robot", "robots"});
  gateway.see("1 publisher matched");
}

const std::vector<std::string> kKeyedTwist = {"sub", "robot", "rt/cmd_vel",
                                              "name=geometry_msgs::msg::dds_::Twist_"};

// One stray end would else keep the base from all that is sent, zeros included.
TEST_P(DdsMatching, AKeyOfSomebodyElseKeepsNobodyFromATopicOfRos2) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1s"));
  const DdsGateway gateway(daemon, domain, kBaseOut + R"( idle="zero"/>)");
  const Stranger stray(GetParam(), domain, kKeyedTwist);
  gateway.see("does not match: key: its type has a key, this entry's has none");
  Stranger base(GetParam(), domain, {"sub", "twist", "rt/cmd_vel"});
  base.await("sample 0 0");
}

TEST_P(DdsMatching, ATopicOfRos2HasAKeyIfTheMappingSaysSo) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1s"));
  const DdsGateway gateway(daemon, domain, kBaseOut + R"( keyed="true"/>)");
  Stranger keyed(GetParam(), domain, kKeyedTwist);
  keyed.await("matched 1");
}

TEST_P(DdsMatching, AKeyIsThatOfMost) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1s"));
  const DdsGateway gateway(daemon, domain,
                           R"(<in topic="robots" type="strangers::Robot" port="/Fleet/robot:o"/>)");
  Stranger stray(GetParam(), domain, {"pub", "blob", "robots", "name=strangers::Robot"});
  stray.await("matched 1");
  gateway.see("1 publisher matched");
  const Stranger robot(GetParam(), domain, {"pub", "robot", "robots"});
  gateway.see("does not match: key: its type has a key, this entry's has none");
  const Stranger another(GetParam(), domain, {"pub", "robot", "robots"});
  gateway.see("2 publishers matched");
}

TEST_P(DdsMatching, WhoeverPublishesPastArbiterIsWarnedOfAtOnce) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1s"));
  const DdsGateway gateway(daemon, domain, kNavIn + kBaseOut + "/>");
  Stranger base(GetParam(), domain, {"sub", "twist", "rt/cmd_vel"});
  base.await("matched 1");
  EXPECT_THAT(gateway.log(), ::testing::Not(::testing::HasSubstr("past Arbiter")));
  Stranger intruder(GetParam(), domain, {"pub", "twist", "rt/cmd_vel"});
  gateway.see("publishes there, too: what it sends reaches the subscribers past Arbiter");
}

TEST(DdsMatchingOfGateways, TheDomainIsSaidWhereNobodyIsInIt) {
  const OwnDomain domain;
  Daemon daemon(base_model("1s"));
  const DdsGateway gateway(daemon, domain, kNavIn + kBaseOut + "/>");
  const std::string number = std::to_string(domain.number());
  gateway.see("its topics are in DDS domain " + number);
  await_described(daemon, "/Nav/cmd_vel:o", "no publisher matched in domain " + number);
  await_described(daemon, "/Base/cmd_vel:i", "no subscriber matched in domain " + number);
}

TEST(DdsMatchingOfGateways, AnotherGatewayIsKnownAsOne) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1s"));
  const DdsGateway gateway(daemon, domain, kBaseOut + "/>");
  gateway.see("serves 0 topics in, 1 out");  // before others are where it looks for its daemon
  const Daemon other_daemon(base_model("1s"));
  const DdsGateway other(other_daemon, domain, kBaseOut + "/>");
  gateway.see("another gateway has this topic, arbiter-gateway-dds (pid ");
  other.see("another gateway has this topic, arbiter-gateway-dds (pid ");
}

// A status has room for a few sentences: none that a stranger can make long may stand before it.
TEST_P(DdsMatching, WhoPublishesPastArbiterStandsInTheStatusBesideMany) {
  const OwnDomain domain;
  Daemon daemon(base_model("1s"));
  const DdsGateway gateway(daemon, domain, kBaseOut + "/>");
  std::vector<Stranger> others;
  for (int i = 0; i < 3; ++i) {
    others.push_back(Stranger("cyclone", domain, {"sub", "bool", "rt/cmd_vel"}));
  }
  gateway.see("does not match");
  const Stranger intruder(GetParam(), domain, {"pub", "twist", "rt/cmd_vel"});
  await_described(daemon, "/Base/cmd_vel:i", "past Arbiter");
}

// Somebody whose ends come and go without end.
TEST(DdsStrangers, ThatComeAndGoWithoutEndAreWarnedOfSoManyTimes) {
  const OwnDomain domain;
  Daemon daemon(base_model("1s"));
  DdsGateway gateway(daemon, domain, kNavIn);
  const gateway::dds::Entity own(dds_create_domain(domain.number(), kLoopback), "domain");
  const gateway::dds::Entity participant(dds_create_participant(domain.number(), nullptr, nullptr),
                                         "participant");
  ddsi_sertype* type = gateway::dds::make_opaque_type("Other", false);
  const gateway::dds::Entity topic(dds_create_topic_sertype(participant.get(), "rt/cmd_vel_nav",
                                                            &type, nullptr, nullptr, nullptr),
                                   "topic");
  for (int i = 0; i < 600; ++i) {
    const gateway::dds::Entity writer(
        dds_create_writer(participant.get(), topic.get(), nullptr, nullptr), "writer");
    if (i % 20 == 0) gateway.see("does not match");
  }
  std::vector<gateway::dds::Entity> many;
  for (int i = 0; i < 600; ++i) {
    many.emplace_back(dds_create_writer(participant.get(), topic.get(), nullptr, nullptr),
                      "writer");
  }
  await_described(daemon, "/Nav/cmd_vel:o", "there are more ends than the gateway looks at");
  Stranger navigation("cyclone", domain, {"pub", "twist", "rt/cmd_vel_nav"});
  navigation.await("matched 1");
  navigation.publish("1 0");
  await_described(daemon, "/Nav/cmd_vel:o", "1 publisher matched");
  EXPECT_LT(gateway.log().size(), 20'000U);
  EXPECT_EQ(gateway.end(), 0);
}

// A node of ROS 2 from Iron on warns of an end without user data, and of a hash that it cannot
// read.
TEST_P(DdsMatching, TheTypeHashOfRos2IsTakenOverAndUntilThenTheUserDataAreNotEmpty) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1s"));
  const DdsGateway gateway(daemon, domain, kNavIn + kBaseOut + "/>");
  Stranger watcher("cyclone", domain, {"watch", "twist", "rt/cmd_vel_nav"});
  Stranger of_writers("cyclone", domain, {"watch", "twist", "rt/cmd_vel"});
  EXPECT_EQ(watcher.next_line(), "reader gateway=arbiter;");
  EXPECT_EQ(of_writers.next_line(), "writer gateway=arbiter;");
  const std::string hash = "typehash=RIHS01_" + std::string(60, '0') + "00ff;";
  Stranger liar(GetParam(), domain,
                {"pub", "twist", "rt/cmd_vel_nav", "data=typehash=RIHS01_00ff;"});
  liar.await("matched 1");
  Stranger navigation(GetParam(), domain, {"pub", "twist", "rt/cmd_vel_nav", "data=" + hash});
  navigation.await("matched 1");
  Stranger base(GetParam(), domain, {"sub", "twist", "rt/cmd_vel", "data=" + hash});
  base.await("matched 1");
  while (watcher.next_line() != "reader " + hash) {
  }
  while (of_writers.next_line() != "writer " + hash) {
  }
}

// It may come later: a network that is slow to start.
TEST(DdsInterface, ThatIsNotThereIsWaitedForAndNamed) {
  const OwnDomain domain;
  Daemon daemon(base_model("1s"));
  DdsGateway gateway(daemon, domain, kNavIn, "nosuch0");
  await_described(daemon, "/Nav/cmd_vel:o", "nosuch0");
  gateway.see("nosuch0: does not match an available interface; trying again");
  ::poll(nullptr, 0, 2500);  // it does try again, and says nothing more
  EXPECT_EQ(gateway.log().find("trying again"), gateway.log().rfind("trying again"));
  EXPECT_EQ(gateway.end(), 0);
}

// Cyclone goes on without it.
TEST(DdsInterface, APeerThatIsNoHostIsNamed) {
  const OwnDomain domain;
  Daemon daemon(base_model("1s"));
  const std::string name(64, 'x');  // longer than a part of a name may be: nobody is asked
  DdsGateway gateway(daemon, domain, kNavIn, "lo", "peers=\"" + name + "\"");
  gateway.see(name + ": unknown address");
  EXPECT_EQ(gateway.end(), 0);
}

}  // namespace
}  // namespace arbiter::test
