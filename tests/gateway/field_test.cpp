// Two sources of one entry: which field of a sample chooses, and by which threshold.
#include <gmock/gmock.h>

#include "tests/gateway/mapping_text.hpp"

namespace arbiter::gateway {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(Mapping, AnEntryHasOnePortOrThoseThatAFieldChooses) {
  const std::string topic = "<in topic='/a' type='std_msgs/msg/Bool' ";
  EXPECT_THAT(read_dds(topic + "port='/a:o' true='/b:o'/>").findings(),
              ElementsAre("1:21 error several-ports"));
  EXPECT_THAT(read_dds(topic + "true='/b:o' below='/c:o'/>").findings(),
              ElementsAre("1:21 error several-ports"));
  EXPECT_THAT(read_dds(topic + "true='/b:o' false='no name'/>").findings(),
              ElementsAre("1:80 error invalid-port-name"));
  EXPECT_THAT(read_dds(topic + "true='/b:o' false='/b:o'/>").findings(),
              ElementsAre("1:80 error duplicate-port"));
  EXPECT_THAT(read_dds(topic + "above='/a:o' below='/b:o'/>").findings(),
              ElementsAre("1:21 error missing-attribute", "1:21 error missing-attribute"));
  EXPECT_THAT(read_dds("<in topic='/a' type='my/msg/State' above='/a:o' below='/b:o' "
                       "threshold='nan' field='u8'/>")
                  .findings(),
              ElementsAre("1:93 error invalid-value"));
  EXPECT_THAT(read_dds(topic + "port='/a:o' offset='3'/>").findings(),
              ElementsAre("1:81 error misplaced-attribute"));
  EXPECT_THAT(read_dds(topic + "true='/a:o' false='/b:o' offset='65536'/>").findings(),
              ElementsAre("1:94 error invalid-value"));
}

TEST(Mapping, OfAFieldThatIsUnknownNothingElseIsSaid) {
  for (const std::string port : {"above='/a:o' ", "below='/a:o' "}) {
    const Read read = read_dds("<in topic='/a' type='std_msgs/msg/Float32' " + port +
                               "threshold='1' field='x32'/>");
    EXPECT_THAT(read.findings(), ElementsAre(HasSubstr("error invalid-value")));
    EXPECT_THAT(read.message(), HasSubstr("field=\"x32\" is not known"));
  }
}

// Most models ask for one of the two.
TEST(Mapping, OneOfTwoSourcesIsEnough) {
  const std::string topic = "<in topic='/a' type='std_msgs/msg/Bool' ";
  const Read pressed = read_dds(topic + "true='/b:o'/>");
  EXPECT_THAT(pressed.findings(), IsEmpty());
  ASSERT_EQ(pressed.entry().ports().size(), 1u);
  EXPECT_EQ(pressed.entry().choice->yes->name, "/b:o");
  EXPECT_FALSE(pressed.entry().choice->no);
  const Read released = read_dds(topic + "false='/b:o'/>");
  EXPECT_THAT(released.findings(), IsEmpty());
  EXPECT_FALSE(released.entry().choice->yes);
  EXPECT_EQ(released.entry().choice->no->name, "/b:o");
  const Read low = read_dds(
      "<in topic='/a' type='std_msgs/msg/Float32' below='/b:o' threshold='1' field='f32'/>");
  EXPECT_THAT(low.findings(), IsEmpty());
  EXPECT_EQ(low.entry().choice->no->name, "/b:o");
}

// It would pass every check, and its sources would be silent for ever.
TEST(Mapping, AFieldIsOneThatASampleHas) {
  const auto read = [](const std::string& type, const std::string& more) {
    return read_dds("<in topic='/a' type='" + type + "' above='/a:o' below='/b:o' " + more + "/>");
  };
  EXPECT_THAT(read("std_msgs/msg/Float32", "threshold='1' field='f32'").findings(), IsEmpty());
  EXPECT_THAT(read("std_msgs/msg/Float32", "threshold='1' field='f32' offset='4'").message(),
              HasSubstr("a std_msgs/msg/Float32 has 4 bytes, and the field would end at 8"));
  EXPECT_THAT(
      read("std_msgs/msg/Float32", "threshold='1' field='u32'").message(),
      HasSubstr("the fields of a std_msgs/msg/Float32 are f32, not u32; write field=\"f32\""));
  EXPECT_THAT(read("std_msgs/msg/Empty", "threshold='1' field='u8'").message(),
              HasSubstr("a std_msgs/msg/Empty says nothing, so that nothing in it can choose "));
  EXPECT_THAT(
      read_dds("<in topic='/a' type='std_msgs/msg/Empty' true='/a:o' false='/b:o'/>").message(),
      HasSubstr("write port=\"…\" in place of the two, or map a topic of another type"));
  EXPECT_THAT(
      read_dds("<in topic='/a' type='std_msgs/msg/String' false='/b:o'/>").message(),
      HasSubstr("a std_msgs/msg/String is a text of any length, so that nothing in it can"));
  EXPECT_THAT(read("std_msgs/msg/Bool", "threshold='1' field='u8'").message(),
              HasSubstr("are Boolean, not u8; write true=\"…\" and false=\"…\""));
  EXPECT_THAT(read_dds("<in topic='/a' type='geometry_msgs/msg/Twist' true='/a:o' false='/b:o'/>")
                  .message(),
              HasSubstr("are f64, not Boolean; write above=\"…\", below=\"…\", a threshold and "
                        "field=\"f64\""));
  EXPECT_THAT(read("std_msgs/msg/Float32", "threshold='1' field='f32' max_size='7'").message(),
              HasSubstr("the sample that type=\"…\" asks for has 8"));
  const std::string topic = "<in service='a' instance='b' event='c' above='/a:o' below='/b:o' ";
  EXPECT_THAT(read_iceoryx(topic + "threshold='1' field='f32' offset='6'/>").findings(), IsEmpty());
  const std::string last = topic + "threshold='1' field='f32' offset='4' max_size=";
  EXPECT_THAT(read_iceoryx(last + "'8'/>").findings(), IsEmpty());
  EXPECT_THAT(read_iceoryx(last + "'7'/>").message(), HasSubstr("beyond max_size, 7 bytes"));
  EXPECT_THAT(
      read_iceoryx(topic + "type='T' size='8' threshold='1' field='f32' offset='5'/>").message(),
      HasSubstr("a T has 8 bytes, and the field would end at 9"));
}

// A lock would be chosen by the name of a frame.
TEST(Mapping, NoFieldIsInAHeader) {
  const auto read = [](const std::string& type, const std::string& more) {
    return read_dds("<in topic='/a' type='" + type + "' above='/a:o' threshold='1' " + more + "/>");
  };
  for (const char* type : {"geometry_msgs/msg/TwistStamped", "sensor_msgs/msg/BatteryState"}) {
    for (const char* offset : {"", "offset='8'", "offset='12'"}) {
      EXPECT_THAT(read(type, std::string("field='f32' ") + offset).message(),
                  HasSubstr("begins with a header of 13 bytes or more, which cannot choose"));
    }
    EXPECT_THAT(read(type, "field='f32' offset='24'").findings(), IsEmpty());
  }
}

TEST(Mapping, AThresholdHasNumbersOnBothSides) {
  const auto read = [](const std::string& threshold, const std::string& field) {
    return read_dds("<in topic='/a' type='my/msg/State' above='/a:o' below='/b:o' threshold='" +
                    threshold + "' field='" + field + "'/>");
  };
  EXPECT_THAT(read("0", "u8").findings(), IsEmpty());
  EXPECT_THAT(read("254", "u8").findings(), IsEmpty());
  EXPECT_THAT(read("-1", "u8").message(), HasSubstr("each number of this field is above it"));
  EXPECT_THAT(read("255", "u8").message(), HasSubstr("is at or below it"));
  EXPECT_THAT(read("-128", "i8").findings(), IsEmpty());
  EXPECT_THAT(read("18446744073709551614", "u64").findings(), IsEmpty());
  EXPECT_THAT(read("18446744073709551615", "u64").message(), HasSubstr("at or below it"));
  EXPECT_THAT(read("1e39", "f32").message(), HasSubstr("at or below it"));
  EXPECT_THAT(read("1e39", "f64").findings(), IsEmpty());
  EXPECT_THAT(read("3.40282346638528859811704183484516925e38", "f32").findings(), IsEmpty())
      << "infinity is above it";
  EXPECT_THAT(read("1e400", "f64").message(), HasSubstr("at or below it"));
}

}  // namespace
}  // namespace arbiter::gateway
