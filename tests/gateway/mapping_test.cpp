// Mapping files: what is read, and what is said of one that is wrong.
#include <gmock/gmock.h>

#include "gateway/mapping/ros_names.hpp"
#include "tests/gateway/mapping_text.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::gateway {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Under another kind each attribute would be an error, and each that it lacks.
TEST(Mapping, EntriesOfTheOtherKindAreToldOfOnce) {
  const std::string topic = "<in topic='/a' type='a/msg/B' port='/a:o'/>";
  const std::string service = "<in service='a' instance='b' event='c' port='/a:o'/>";
  const Read dds = read_iceoryx(topic + topic);
  EXPECT_THAT(dds.findings(), ElementsAre("1:36 error other-kind"));
  EXPECT_THAT(dds.message(),
              HasSubstr("topic=\"…\" belongs to an entry of a <gateway kind=\"dds\">, and this one "
                        "has kind=\"iceoryx\"; correct the kind, or name a topic of iceoryx: "
                        "service=\"…\""));
  const Read iceoryx = read_dds(service + service);
  EXPECT_THAT(iceoryx.findings(), ElementsAre("1:34 error other-kind"));
  EXPECT_THAT(iceoryx.message(), HasSubstr("correct the kind, or name a topic of DDS: topic="));
}

TEST(Mapping, ReadsRos2NamesAsDdsHasThem) {
  const Read read = read_text(
      "<gateway kind='dds' domain='7' interface='lo, eth0' peers='10.0.0.2'>\n"
      "  <in topic='/cmd_vel_nav' type='geometry_msgs/msg/Twist' port='/Nav/cmd_vel:o'/>\n"
      "  <out port='/Base/cmd_vel:i' topic='/cmd_vel' type='geometry_msgs/msg/Twist' "
      "idle='zero'/>\n"
      "</gateway>\n");
  ASSERT_THAT(read.findings(), IsEmpty());
  const Gateway& gateway = read.mapping.gateways.at(0);
  EXPECT_EQ(gateway.kind, Kind::kDds);
  EXPECT_EQ(gateway.domain, 7u);
  EXPECT_THAT(gateway.interfaces, ElementsAre("lo", "eth0"));
  EXPECT_THAT(gateway.peers, ElementsAre("10.0.0.2"));
  ASSERT_EQ(gateway.entries.size(), 2u);
  const Entry& in = gateway.entries[0];
  EXPECT_TRUE(in.is_in());
  EXPECT_EQ(in.dds->name, "rt/cmd_vel_nav");
  EXPECT_EQ(in.dds->type, "geometry_msgs::msg::dds_::Twist_");
  EXPECT_TRUE(in.dds->is_ros);
  EXPECT_EQ(in.dds->qos.depth, 10u);
  EXPECT_EQ(in.port->name, "/Nav/cmd_vel:o");
  EXPECT_EQ(in.type->name, "geometry_msgs/msg/Twist");
  EXPECT_EQ(in.type->size, 0u);
  EXPECT_EQ(in.outside(), "DDS topic rt/cmd_vel_nav");
  const Entry& out = gateway.entries[1];
  EXPECT_FALSE(out.is_in());
  ASSERT_EQ(out.idle.sample.size(), 52u);
  EXPECT_EQ(out.idle.sample[1], std::byte{1});
}

TEST(Mapping, ReadsPlainDdsNamesAsTheyAre) {
  const Read read = read_dds(
      "<in topic='Square' type='Shapes::ShapeType' port='/s:o' "
      "reliability='best_effort' durability='volatile' "
      "history='keep_last' depth='3' deadline='100ms' partition='a,b*' "
      "keyed='true' max_size='1MiB' max_age='50ms'/>");
  ASSERT_THAT(read.findings(), IsEmpty());
  const Entry& entry = read.entry();
  EXPECT_FALSE(entry.dds->is_ros);
  EXPECT_EQ(entry.dds->name, "Square");
  EXPECT_EQ(entry.type->name, "Shapes::ShapeType");
  EXPECT_EQ(entry.dds->qos.reliability, Reliability::kBestEffort);
  EXPECT_EQ(entry.dds->qos.durability, Durability::kVolatile);
  EXPECT_EQ(entry.dds->qos.depth, 3u);
  EXPECT_EQ(entry.dds->qos.deadline, 100'000'000);
  EXPECT_THAT(entry.dds->qos.partitions, ElementsAre("a", "b*"));
  EXPECT_EQ(entry.dds->qos.keyed, true);
  EXPECT_EQ(entry.max_size, std::size_t{1} << 20);
  EXPECT_EQ(entry.max_age, 50'000'000);
}

TEST(Mapping, APresetIsTakenAndCanBeChanged) {
  const Read read = read_dds(
      "<in topic='/scan' type='sensor_msgs/msg/LaserScan' port='/s:o' "
      "qos='sensor_data' depth='2'/>");
  ASSERT_THAT(read.findings(), IsEmpty());
  EXPECT_EQ(read.entry().dds->qos.reliability, Reliability::kBestEffort);
  EXPECT_EQ(read.entry().dds->qos.depth, 2u);
}

// As rmw/qos_profiles.h has them, and the defaults of DDS where ROS 2 leaves it to DDS.
TEST(Mapping, ROS2sProfilesHaveTheirNames) {
  using enum Reliability;
  using enum Durability;
  struct Profile {
    const char* name;
    Reliability of_in, of_out;
    Durability durability;
    std::uint32_t depth;
  };
  for (const Profile& each : {Profile{"default", kReliable, kReliable, kVolatile, 10},
                              Profile{"sensor_data", kBestEffort, kBestEffort, kVolatile, 5},
                              Profile{"latched", kReliable, kReliable, kTransientLocal, 1},
                              Profile{"system_default", kBestEffort, kReliable, kVolatile, 1},
                              Profile{"services_default", kReliable, kReliable, kVolatile, 10},
                              Profile{"services", kReliable, kReliable, kVolatile, 10},
                              Profile{"parameters", kReliable, kReliable, kVolatile, 1000},
                              Profile{"parameter_events", kReliable, kReliable, kVolatile, 1000},
                              Profile{"clock", kBestEffort, kBestEffort, kVolatile, 1},
                              Profile{"rosout", kReliable, kReliable, kTransientLocal, 1000}}) {
    for (const bool is_in : {true, false}) {
      const Read read =
          read_dds(std::string(is_in ? "<in" : "<out") +
                   " topic='/t' type='std_msgs/msg/Bool' port='/p' qos='" + each.name + "'/>");
      ASSERT_THAT(read.findings(), IsEmpty()) << each.name;
      const Qos& qos = read.entry().dds->qos;
      EXPECT_EQ(qos.reliability, is_in ? each.of_in : each.of_out) << each.name << is_in;
      EXPECT_EQ(qos.durability, each.durability) << each.name;
      EXPECT_EQ(qos.depth, each.depth) << each.name;
      EXPECT_EQ(qos.history, History::kKeepLast) << each.name;
    }
  }
}

TEST(Mapping, ABooleanTopicIsTwoSources) {
  const Read read = read_dds(
      "<in topic='/estop' type='std_msgs/msg/Bool' true='/EStop/pressed:o' "
      "false='/EStop/released:o'/>");
  ASSERT_THAT(read.findings(), IsEmpty());
  ASSERT_TRUE(read.entry().choice);
  EXPECT_FALSE(read.entry().port);
  EXPECT_EQ(read.entry().choice->yes->name, "/EStop/pressed:o");
  EXPECT_EQ(read.entry().choice->no->name, "/EStop/released:o");
  EXPECT_EQ(read.entry().choice->field, Field::kBoolean);
}

TEST(Mapping, ANumberOnTwoSidesOfAThresholdIsTwoSources) {
  const Read read = read_iceoryx(
      "<in service='a' instance='b' event='c' above='/full:o' "
      "below='/empty:o' field='i64' offset='16' "
      "threshold='9007199254740993'/>");
  ASSERT_THAT(read.findings(), IsEmpty());
  const Choice& choice = *read.entry().choice;
  EXPECT_EQ(choice.field, Field::kI64);
  EXPECT_EQ(choice.offset, 16u);
  EXPECT_EQ(choice.threshold, 9007199254740993.0L);
}

TEST(Mapping, AnIceoryxTopicHasThreeNamesAndMayHaveAHeader) {
  const Read read = read_iceoryx(
      "<in service='Radar' instance='Front' event='Objects' "
      "port='/Radar/objects:o' type='Objects' size='40' alignment='16' "
      "user_header='8' queue='4'/>"
      "<out port='/p:i' service='A' instance='B' event='C' size='24' "
      "idle='zero' queue='3' history='2'/>");
  ASSERT_THAT(read.findings(), IsEmpty());
  const Entry& in = read.entry(0);
  EXPECT_EQ(in.outside(), "iceoryx Radar/Front/Objects");
  EXPECT_EQ(in.iceoryx->padded_header(), 16u);
  EXPECT_EQ(in.type->size, 56u);
  EXPECT_EQ(in.type->alignment, 16u);
  EXPECT_EQ(in.iceoryx->queue, 4u);
  EXPECT_FALSE(read.entry(1).type);
  EXPECT_EQ(read.entry(1).idle.sample.size(), 24u);
  EXPECT_EQ(read.entry(1).queue, 3u);
  EXPECT_EQ(read.entry(1).iceoryx->history, 2u);
}

TEST(Mapping, SeveralGatewaysMayStandInOneFile) {
  const std::string two = "<gateway kind='dds' domain='0'/><gateway kind='iceoryx'/>";
  EXPECT_EQ(read_text(two).mapping.gateways.size(), 2u);
  EXPECT_EQ(read_text("<gateways>" + two + "</gateways>").mapping.gateways.size(), 2u);
}

TEST(Mapping, AllProblemsOfAFileAreReportedInOneGo) {
  const Read read = read_text(
      "<gateway kind='dds' domain='1000' colour='red'>\n"
      "  <in topic='/a' type='geometry_msgs/msg/Twist' prot='/a:o'/>\n"
      "  <in topic='/a b' type='geometry_msgs/msg/Twist' port='a:o'/>\n"
      "  <in topic='/a' type='Twist' port='/b:o' max_size='0'/>\n"
      "  <in topic='a' type='geometry_msgs/msg/Twist' port='/c:o' reliability='reliabel'/>\n"
      "  <out port='/b:i' topic='/b' type='x/y/z' idle='zero'/>\n"
      "  <inn/>\n"
      "  text\n"
      "</gateway>\n");
  EXPECT_THAT(read.findings(),
              ElementsAre("1:35 error unknown-attribute", "1:29 error invalid-value",
                          "8:3 error stray-text", "2:49 error unknown-attribute",
                          "2:3 error missing-attribute", "3:14 error invalid-topic",
                          "3:57 error invalid-port-name", "4:24 error invalid-type",
                          "4:53 error invalid-value", "5:14 error invalid-topic",
                          "5:73 error invalid-value", "6:37 error invalid-type",
                          "6:50 error idle-size", "7:3 error unknown-element"));
  EXPECT_THAT(read.message(3), HasSubstr("did you mean port?"));
  EXPECT_THAT(read.message(10), HasSubstr("did you mean \"reliable\"?"));
}

// Its ports could never be opened.
TEST(Mapping, ATypeThatNoPortCanHaveIsRefused) {
  const Read dds = read_dds("<in topic='T' type='A\u200bB' port='/a:o'/>");
  EXPECT_THAT(dds.findings(), ElementsAre("1:41 error invalid-type"));
  EXPECT_THAT(dds.message(), HasSubstr("cannot be a type: "));
  EXPECT_THAT(read_iceoryx("<in service='a' instance='b' event='c' port='/a:o' type='A\u200bB'/>")
                  .findings(),
              ElementsAre(HasSubstr("error invalid-type")));
}

TEST(Mapping, ADurationThatIsNoneIsToldWhatToWrite) {
  const auto max_age = [](const std::string& text) {
    return read_dds("<in topic='a' type='State' port='/a:o' max_age='" + text + "'/>").message();
  };
  EXPECT_THAT(max_age("5min"), HasSubstr("max_age=\"5min\" has an unknown unit; write 300s in"));
  EXPECT_THAT(max_age("0.5s"), HasSubstr("max_age=\"0.5s\" is a fraction; write 500ms in"));
  EXPECT_THAT(max_age("0s"), HasSubstr("max_age=\"0s\" is zero; write at least 1ns"));
  EXPECT_THAT(max_age("100"), HasSubstr("max_age=\"100\" has no unit; write a whole number"));
  EXPECT_THAT(max_age("forever"), HasSubstr("is not a whole number with a unit; write"));
}

TEST(Mapping, AFileWithoutAGatewaySaysWhatToWrite) {
  EXPECT_THAT(read_text("").findings(), ElementsAre("1:1 error empty-file"));
  EXPECT_THAT(read_text("<gateway/>").findings(), ElementsAre("1:1 error missing-attribute"));
  EXPECT_THAT(read_text("<gateway kind='ros'/>").findings(),
              ElementsAre("1:16 error invalid-value"));
  EXPECT_THAT(read_text("<behaviors/>").message(), HasSubstr("it takes <gateway>"));
  EXPECT_THAT(read_text("<gateways/><gateway kind='dds'/>").findings(),
              ElementsAre("1:12 error unknown-element"));
}

// Otherwise Cyclone refuses it when the domain is joined, and does not say what it dislikes.
TEST(Mapping, NamesAreOnesThatCycloneTakes) {
  const auto topic = [](const std::string& name) {
    return read_dds("<in topic='" + name + "' type='State' port='/a:o'/>");
  };
  EXPECT_THAT(topic("rt/state_2").findings(), IsEmpty());
  for (const char* const name : {"a b", "rt/a%41", "2nd", "a-b", "a::b", "DCPSParticipant"}) {
    EXPECT_THAT(topic(name).findings(), ElementsAre("1:32 error invalid-topic")) << name;
  }
  const auto of_ros = [](const std::string& name) {
    return read_dds("<in topic='" + name + "' type='my/msg/State' port='/a:o'/>").message();
  };
  EXPECT_THAT(of_ros("rt/state"), HasSubstr("write \"/state\","));
  EXPECT_THAT(of_ros("~/state"), HasSubstr("write \"/state\","));
  EXPECT_THAT(of_ros("state"), HasSubstr("write \"/state\","));
  EXPECT_THAT(of_ros("~//"), HasSubstr("write \"/base/cmd_vel\","));
  EXPECT_THAT(of_ros("/2nd"), HasSubstr("not a digit first"));
  EXPECT_THAT(read_text("<gateway kind='dds' interface='lo,eth0, lo'/>").message(),
              HasSubstr("\"lo\" is named twice"));
  EXPECT_THAT(read_text("<gateway kind='dds' peers='10.0.0.1, 10.0.0.2 10.0.0.3'/>").message(),
              HasSubstr("\"10.0.0.2 10.0.0.3\" is no address and no name"));
}

// Before the robot moves, and not when the gateway starts.
TEST(Mapping, AConfigurationThatCannotBeReadIsReported) {
  const test::TemporaryDirectory directory;
  directory.write("dds.xml", "<CycloneDDS/>");
  const std::string path = directory.path();
  const auto with = [&](const std::string& file) {
    return read_text("<gateway kind='dds' configuration='" + file + "'/>", &path);
  };
  EXPECT_THAT(with("dds.xml").findings(), IsEmpty());
  const Read missing = with("none.xml");
  EXPECT_THAT(missing.findings(), ElementsAre("1:36 error configuration-file"));
  EXPECT_THAT(missing.message(), HasSubstr("none.xml"));
  EXPECT_THAT(with(".").findings(), ElementsAre("1:36 error configuration-file"));
}

// Before a reload closes what is open.
TEST(Mapping, AConfigurationThatIsCutIsReportedAtItsPlaceAndAGoodOneIsKept) {
  const test::TemporaryDirectory directory;
  directory.write("good.xml", "\xef\xbb\xbf<CycloneDDS>\n</CycloneDDS>");  // a byte order mark
  directory.write("cut.xml", "<CycloneDDS>\n  <Domain></CycloneDDS>");
  directory.write("large.xml", std::string((1 << 20) + 1, ' '));
  const std::string path = directory.path();
  const auto with = [&](const std::string& file) {
    return read_text("<gateway kind='dds' configuration='" + file + "'/>", &path);
  };
  EXPECT_EQ(with("good.xml").mapping.gateways.at(0).configuration_text,
            "<CycloneDDS>\n</CycloneDDS>");
  EXPECT_THAT(with("cut.xml").findings(), ElementsAre("2:11 error malformed-xml"));
  EXPECT_THAT(with("large.xml").findings(), ElementsAre(HasSubstr("error limit-exceeded")));
  for (const char* const other :
       {"", "hello", "<behaviors/>", "<General/>", "<CycloneDDS/><CycloneDDS/>"}) {
    directory.write("other.xml", other);
    EXPECT_THAT(with("other.xml").message(), HasSubstr("its one root is <CycloneDDS>")) << other;
  }
  directory.write("small.xml", "<?xml version='1.0'?><cyclonedds/>");
  EXPECT_THAT(with("small.xml").findings(), IsEmpty());
}

TEST(Mapping, WhatContradictsItselfIsAnError) {
  const std::string topic = " service='a' instance='b' event='c' ";
  EXPECT_THAT(read_iceoryx("<in port='/a:o'" + topic + "size='4'/>").findings(),
              ElementsAre("1:82 error misplaced-attribute"));
  EXPECT_THAT(read_iceoryx("<out port='/a:i'" + topic + "size='4'/>").findings(),
              ElementsAre("1:83 error misplaced-attribute"));
  EXPECT_THAT(
      read_iceoryx("<in port='/a:o'" + topic + "type='T' size='100' max_size='99'/>").message(),
      HasSubstr("max_size is 99 bytes, and the sample that size=\"…\" asks for has 100"));
  EXPECT_THAT(read_dds("<out port='/a:i' topic='/a' type='std_msgs/msg/Bool' idle='zero' "
                       "max_size='4'/>")
                  .message(),
              HasSubstr("the sample that type=\"…\" asks for has 5"));
  // Without max_size it is as large as it must be.
  const Read large = read_iceoryx("<in port='/a:o'" + topic + "type='T' size='1MiB'/>");
  ASSERT_THAT(large.findings(), IsEmpty());
  EXPECT_EQ(large.entry().max_size, std::size_t{1} << 20);
}

// What is not as large is no sample of the type: it must not win.
TEST(Mapping, TheSizeOfATypeOfDdsIsKnownOrSaid) {
  const auto in = [](const std::string& type, const std::string& more = "") {
    return read_dds("<in port='/a:o' topic='/a' type='" + type + "' " + more + "/>");
  };
  EXPECT_EQ(in("geometry_msgs/msg/Twist").entry().dds->size, 48u);
  EXPECT_EQ(in("my_msgs/msg/Drive").entry().dds->size, std::nullopt);
  EXPECT_EQ(in("my_msgs/msg/Drive", "size='16'").entry().dds->size, 16u);
  EXPECT_EQ(in("my_msgs/msg/Drive", "size='128KiB'").entry().max_size, 4u + (128u << 10));
  EXPECT_THAT(in("geometry_msgs/msg/Twist", "size='44'").message(), HasSubstr("has 48 bytes"));
  EXPECT_THAT(in("std_msgs/msg/String", "size='44'").message(),
              HasSubstr("its samples have not all one size"));
  EXPECT_THAT(in("my_msgs/msg/Drive", "size='8' max_size='11'").message(),
              HasSubstr("the sample that size=\"…\" asks for has 12"));
  const Read out =
      read_dds("<out port='/a:i' topic='/a' type='my_msgs/msg/Drive' size='16' idle='none'/>");
  EXPECT_THAT(out.findings(), IsEmpty());
  EXPECT_EQ(out.entry().dds->size, 16u);
  EXPECT_THAT(
      read_dds("<in topic='/a' type='my_msgs/msg/Low' above='/a:o' below='/b:o' field='f64' "
               "threshold='1' size='4'/>")
          .message(),
      HasSubstr("a my_msgs/msg/Low has 4 bytes, and the field would end at 8"));
}

TEST(Mapping, RouDisOwnTopicsCanBeReadAndNotWritten) {
  const std::string topic = " service='Introspection' instance='RouDi_ID' event='Port' ";
  EXPECT_THAT(read_iceoryx("<in port='/a:o'" + topic + "/>").findings(), IsEmpty());
  EXPECT_THAT(read_iceoryx("<out port='/a:i'" + topic + "/>").message(),
              HasSubstr("lets nobody else"));
}

TEST(Mapping, ListsAreBounded) {
  std::string many = "a";
  for (int i = 0; i < 64; ++i) many += ",a";
  EXPECT_THAT(read_text("<gateway kind='dds' peers='" + many + "'/>").message(),
              HasSubstr("write at most 64 values"));
}

TEST(Mapping, NamesOfRos2AreToldFromOthers) {
  for (const char* good : {"/a", "/a/b_c", "/_x/Y9"}) EXPECT_TRUE(is_ros_topic(good)) << good;
  for (const char* bad : {"", "/", "a", "/a/", "/a//b", "/9a", "/a b", "/a-b"}) {
    EXPECT_FALSE(is_ros_topic(bad)) << bad;
  }
  for (const char* good : {"std_msgs/msg/Bool", "a/srv/B_Request"}) EXPECT_TRUE(is_ros_type(good));
  for (const char* bad : {"Bool", "std_msgs/Bool", "std_msgs/msg/bool", "/msg/Bool", "a/b/C",
                          "a/msg/C/D", "a/msg/"}) {
    EXPECT_FALSE(is_ros_type(bad)) << bad;
  }
  EXPECT_EQ(readable_type(dds_type_of("std_msgs/msg/Bool")), "std_msgs/msg/Bool");
  EXPECT_EQ(readable_type("a::b::C"), "a::b::C");
  EXPECT_EQ(readable_type("a::dds_::C_"), "a::dds_::C_");
}

TEST(Mapping, AFileCutAnywhereIsAnError) {
  const std::string whole =
      "<gateway kind='dds' domain='0'>\n"
      "  <in topic='/a' type='geometry_msgs/msg/Twist' port='/a:o'/>\n"
      "  <out port='/b:i' topic='/b' type='geometry_msgs/msg/Twist' idle='zero'/>\n"
      "</gateway>";
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const Read read = read_text(whole.substr(0, length));
    ASSERT_TRUE(read.diagnostics.has_errors()) << whole.substr(0, length);
  }
}

TEST(Mapping, EntriesAreBounded) {
  std::string entries;
  for (std::size_t i = 0; i < kMaxEntries + 3; ++i) {
    entries += "<in topic='t' type='T' port='/p" + std::to_string(i) + ":o'/>";
  }
  const Read read = read_dds(entries);
  ASSERT_EQ(read.findings().size(), 1u);
  EXPECT_THAT(read.findings().front(), HasSubstr("too-many-entries"));
  EXPECT_EQ(read.mapping.gateways.front().entries.size(), kMaxEntries);
}

}  // namespace
}  // namespace arbiter::gateway
