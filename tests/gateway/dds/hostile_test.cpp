// Strangers that send what no honest program would: the gateway counts it, and passes on what the
// honest ones send.
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "gateway/dds/entity.hpp"
#include "gateway/dds/opaque_type.hpp"
#include "tests/gateway/dds/noise.hpp"
#include "tests/gateway/dds/scene.hpp"
#include "tests/support/await.hpp"

namespace arbiter::test {
namespace {

using gateway::dds::CycloneQos;
using gateway::dds::Entity;

// A publisher of any bytes at all.
class Liar {
 public:
  Liar(const OwnDomain& domain, const std::string& topic, const std::string& type,
       bool reliable = true)
      : domain_(dds_create_domain(domain.number(), kLoopback), "domain"),
        participant_(dds_create_participant(domain.number(), nullptr, nullptr), "participant") {
    type_ = gateway::dds::make_opaque_type(type, false);
    topic_ = Entity(dds_create_topic_sertype(participant_.get(), topic.c_str(), &type_, nullptr,
                                             nullptr, nullptr),
                    "topic");
    const CycloneQos qos(dds_create_qos());
    dds_qset_reliability(
        qos.get(), reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, DDS_SECS(1));
    dds_qset_history(qos.get(), DDS_HISTORY_KEEP_ALL, 1);
    writer_ =
        Entity(dds_create_writer(participant_.get(), topic_.get(), qos.get(), nullptr), "writer");
  }
  void await_reader() const {
    dds_publication_matched_status_t status{};
    while (status.current_count == 0) {
      dds_get_publication_matched_status(writer_.get(), &status);
      ::poll(nullptr, 0, 1);
    }
  }
  void publish(const std::string& bytes) const {
    gateway::dds::Payload* const payload = gateway::dds::make_payload(
        type_, Bytes(reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()));
    ASSERT_EQ(dds_writecdr(writer_.get(), &payload->cyclone), DDS_RETCODE_OK);
  }

 private:
  Entity domain_;
  Entity participant_;
  ddsi_sertype* type_ = nullptr;
  Entity topic_;
  Entity writer_;
};

const std::string kLittle("\0\1\0\0", 4);

// Cyclone drops them by itself, with the datagram that they stand in.
TEST(DdsHostile, WhatIsNotEncodedAsDdsEncodesIsPassedOver) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1000s"));
  const DdsGateway gateway(daemon, domain,
                           R"(<in topic="/cmd_vel_nav" reliability="best_effort" )" + kTwist +
                               R"( port="/Nav/cmd_vel:o"/>)" + kBaseOut + "/>");
  Stranger base("fast", domain, {"sub", "twist", "rt/cmd_vel"});
  const Liar liar(domain, "rt/cmd_vel_nav", "geometry_msgs::msg::dds_::Twist_", false);
  base.await("matched 1");
  liar.await_reader();
  gateway.see("1 publisher matched");
  gateway.see("1 subscriber matched");
  for (const std::string& bytes :
       {std::string("\xff\xff\0\0", 4), std::string("\0\4\0\0", 4) + std::string(48, 'x'),
        std::string("\1\1\0\0", 4) + std::string(48, 'x'), std::string(200, '\x7f')}) {
    liar.publish(bytes);
  }
  liar.publish(kLittle + std::string(48, '\0'));
  EXPECT_EQ(base.next_line(), "sample 0 0");
  gateway.see("malformed packet");
}

class DdsOfAnotherLayout : public ::testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Vendors, DdsOfAnotherLayout, ::testing::Values("cyclone", "fast"),
                         [](const auto& each) { return std::string(each.param); });

// Else it would override navigation, and the base, whose DDS drops it, would obey nobody.
TEST_P(DdsOfAnotherLayout, ATwistThatCannotBeOneDoesNotWin) {
  const OwnDomain domain;
  Daemon daemon(base_model("1000s"));
  const DdsGateway gateway(daemon, domain, kNavIn + kTeleopIn + kBaseOut + "/>");
  Stranger base(GetParam(), domain, {"sub", "twist", "rt/cmd_vel"});
  Stranger navigation(GetParam(), domain, {"pub", "twist", "rt/cmd_vel_nav"});
  Stranger teleop(GetParam(), domain,
                  {"pub", "bool", "rt/cmd_vel_teleop", "name=geometry_msgs::msg::dds_::Twist_"});
  base.await("matched 1");
  navigation.await("matched 1");
  teleop.await("matched 1");
  await_described(daemon, "/Teleop/cmd_vel:o", "1 publisher matched");
  publish_until_heard(navigation, base, "1 0");
  while (!is_described(daemon, "/Teleop/cmd_vel:o", "unreadable")) {
    teleop.publish("1");
    ::poll(nullptr, 0, 1);
  }
  await_described(daemon, "/Teleop/cmd_vel:o",
                  "unreadable; the last bad sample has 8 bytes; geometry_msgs/msg/Twist has 52");
  EXPECT_EQ(daemon.source("/Teleop/cmd_vel:o")["published"], 0);
  publish_until_heard(navigation, base, "2 0");
}

// Of other types the mapping may say it.
TEST(DdsHostile, ASampleOfAnotherSizeThanTheMappingSaysIsNoArrival) {
  const OwnDomain domain;
  Daemon daemon("<behaviors timeout=\"1000s\"><source port=\"/Fleet/robot:o\"/></behaviors>");
  const DdsGateway gateway(
      daemon, domain,
      R"(<in topic="robots" type="strangers::Robot" port="/Fleet/robot:o" size="16"/>)");
  const Liar liar(domain, "robots", "strangers::Robot");
  liar.await_reader();
  gateway.see("1 publisher matched");
  liar.publish(kLittle + std::string(8, '\0'));
  await_described(daemon, "/Fleet/robot:o",
                  "1 unreadable; the last bad sample has 12 bytes; strangers::Robot has 20");
  EXPECT_EQ(daemon.source("/Fleet/robot:o")["published"], 0);
  liar.publish(kLittle + std::string(16, '\0'));
  await([&] { return daemon.source("/Fleet/robot:o")["published"] == 1; });
}

// A liar on a topic that chooses between two sources.
struct Choosing {
  // `entry`: the rest of the <in>.
  Choosing(const std::string& topic, const std::string& type, const std::string& entry)
      : daemon(
            "<behaviors timeout=\"1000s\"><source port=\"/yes:o\"/><source port=\"/no:o\"/>"
            "</behaviors>"),
        gateway(daemon, domain, "<in " + entry + "/>"),
        liar(domain, topic, type) {
    liar.await_reader();
    gateway.see("1 publisher matched");
  }
  // Publishes it, and returns once the source has got it.
  void publish_to(const std::string& source, const std::string& bytes) {
    const int before = published(source);
    liar.publish(bytes);
    await([&] { return published(source) == before + 1; });
  }
  // Publishes it, and returns once neither source is active.
  void publish_to_none(const std::string& bytes) {
    liar.publish(bytes);
    while (is_active("/yes:o") || is_active("/no:o")) {
    }
  }
  int published(const std::string& source) { return daemon.source(source).value("published", 0); }
  bool is_active(const std::string& source) { return daemon.source(source).value("active", false); }

  OwnDomain domain;
  Daemon daemon;
  DdsGateway gateway;
  Liar liar;
};

struct Button : Choosing {
  Button()
      : Choosing("rt/ready", "std_msgs::msg::dds_::Bool_",
                 R"(topic="/ready" type="std_msgs/msg/Bool" true="/yes:o" false="/no:o")") {}
};

// A lock that says neither that it is pressed nor that it is released is not released.
TEST(DdsHostile, ABooleanThatIsNoneEndsBothSources) {
  Button button;
  for (const std::string& none : {std::string("\2"), std::string("\xff"), std::string()}) {
    button.publish_to("/no:o", kLittle + std::string(1, '\0'));
    EXPECT_TRUE(button.is_active("/no:o"));
    button.publish_to_none(kLittle + none);
  }
  await_described(button.daemon, "/no:o",
                  "the last bad sample has 4 bytes; std_msgs/msg/Bool has 8");
}

// An appendable type of XCDR2 begins with its length, which is 1 for a Boolean; a mutable one has
// headers before its fields. Read as one of a final type, each would be true.
TEST(DdsHostile, ABooleanThatStandsElsewhereEndsBothSources) {
  Button button;
  const std::string length("\1\0\0\0", 4);
  for (const char kind : {'\2', '\3', '\x8', '\x9', '\xa', '\xb'}) {
    button.publish_to("/yes:o", kLittle + '\1');
    button.publish_to_none(std::string("\0", 1) + kind + std::string("\0\0", 2) + length + '\0');
  }
  // Of a final one the first field stands where it does in XCDR1.
  button.publish_to("/yes:o", std::string("\0\7\0\0", 4) + '\1');
}

// XCDR2 aligns a double to four bytes: at the place that XCDR1 has for it stand halves of two.
TEST(DdsHostile, ANumberThatStandsElsewhereEndsBothSources) {
  Choosing battery("robots", "strangers::Robot",
                   R"(topic="robots" type="strangers::Robot" above="/yes:o" below="/no:o" )"
                   R"(threshold="0.2" field="f64" offset="8")");
  std::string half(8, '\0');
  const double value = 0.5;
  std::memcpy(half.data(), &value, sizeof value);
  battery.publish_to("/yes:o", kLittle + std::string(8, '\0') + half);
  battery.publish_to_none(std::string("\0\7\0\0", 4) + std::string(4, '\0') + half + half);
  EXPECT_EQ(battery.published("/no:o"), 0);
}

// Cut off at each byte, and then padded to a multiple of four, as RTPS wants it: what it is padded
// with is not the field.
TEST(DdsHostile, ASampleThatEndsBeforeItsFieldEndsBothSources) {
  constexpr std::size_t kOffset = 5;
  Choosing button("robots", "strangers::Robot",
                  R"(topic="robots" type="strangers::Robot" true="/yes:o" false="/no:o" )"
                  R"(offset="5")");
  const auto with_padding = [](const std::string& data) {
    const char padding = static_cast<char>((4 - data.size() % 4) % 4);
    return std::string("\0\1\0", 3) + padding + data;
  };
  const std::string before(kOffset, 'a');
  for (std::size_t size = 0; size <= kOffset; ++size) {
    button.publish_to("/yes:o", with_padding(before + '\1'));
    button.publish_to_none(with_padding(before.substr(0, size)));
  }
  EXPECT_EQ(button.published("/no:o"), 0);
  button.publish_to("/no:o", with_padding(before + '\0'));
}

TEST(DdsHostile, ANumberThatIsCutOffEndsBothSources) {
  Choosing battery("robots", "strangers::Robot",
                   R"(topic="robots" type="strangers::Robot" above="/yes:o" below="/no:o" )"
                   R"(threshold="0.2" field="f32" offset="4")");
  const std::string half("\0\0\0?", 4);  // 0.5
  const std::string big(half.rbegin(), half.rend());
  for (std::size_t size = 0; size < 8; ++size) {
    battery.publish_to("/yes:o", kLittle + "aaaa" + half);
    const std::string cut = ("aaaa" + half).substr(0, size);
    const char padding = static_cast<char>((4 - size % 4) % 4);
    battery.publish_to_none(std::string("\0\1\0", 3) + padding + cut);
  }
  EXPECT_EQ(battery.published("/no:o"), 0);
  battery.publish_to("/yes:o", std::string(4, '\0') + "aaaa" + big);
}

TEST(DdsHostile, ItLivesThroughDatagramsThatAreNoneOfRtps) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1000s"));
  DdsGateway gateway(daemon, domain, kNavIn + kBaseOut + "/>");
  Stranger base("cyclone", domain, {"sub", "twist", "rt/cmd_vel"});
  Stranger navigation("fast", domain, {"pub", "twist", "rt/cmd_vel_nav"});
  base.await("matched 1");
  navigation.await("matched 1");
  gateway.see("1 publisher matched");
  publish_until_heard(navigation, base, "1 0");
  send_noise(domain);
  publish_until_heard(navigation, base, "2 0");
  EXPECT_EQ(gateway.end(), 0) << gateway.log();
  EXPECT_LT(gateway.log().size(), 100'000U);
}

}  // namespace
}  // namespace arbiter::test
