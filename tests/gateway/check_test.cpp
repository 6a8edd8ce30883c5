// Entries beside each other and beside a model.
#include <gmock/gmock.h>

#include <string>

#include "tests/gateway/check_scene.hpp"

namespace arbiter::gateway {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(CheckMapping, AGoodMappingHasNoFindings) {
  EXPECT_THAT(check(dds(in("/nav", "/Nav/cmd:o") + out("/cmd", "/Base/cmd:i"))).findings(),
              IsEmpty());
}

// A base is not told to stop because somebody else who listens there is stopped in a debugger.
TEST(CheckMapping, WhatSaysStopIsNotHeldUpByAnotherSubscriber) {
  EXPECT_THAT(check(dds(out("/cmd", "/Base/cmd:i", "history='keep_all'"))).findings(),
              ElementsAre(HasSubstr("warning held-up-idle")));
  EXPECT_THAT(check(dds(out("/cmd", "/Base/cmd:i", "history='keep_all' reliability='best_effort'")))
                  .findings(),
              IsEmpty());
}

// What was published before the gateway came is old; where T is forever, it still holds.
TEST(CheckMapping, SamplesFromBeforeItCameAreForSourcesThatStayActive) {
  const std::string lock =
      "<in topic='/lock' type='std_msgs/msg/Bool' true='/EStop/pressed:o' "
      "false='/EStop/released:o' qos='latched'/>";
  const std::string all_forever =
      "<behaviors><source port='/EStop/pressed:o' timeout='forever'/>"
      "<source port='/EStop/released:o' timeout='forever'/>"
      "<behavior name='Drive'><config at='/Base/cmd:i'>/Nav/cmd:o</config>"
      "<condition>not /EStop/pressed:o</condition></behavior></behaviors>";
  EXPECT_THAT(check(dds(lock), all_forever).findings(), IsEmpty());
  EXPECT_THAT(check(dds(lock), "").findings(), IsEmpty());  // T is not known
  const std::string pressed =
      "<in topic='/lock' type='std_msgs/msg/Bool' true='/EStop/pressed:o' qos='latched'/>";
  EXPECT_THAT(check(dds(pressed),
                    "<behaviors><source port='/EStop/pressed:o' timeout='forever'/>"
                    "<behavior name='Drive'><config at='/Base/cmd:i'>/Nav/cmd:o"
                    "</config><condition>not /EStop/pressed:o</condition></behavior>"
                    "</behaviors>")
                  .findings(),
              IsEmpty());
  const Read read = check(dds(lock));
  ASSERT_THAT(read.findings(), ElementsAre(HasSubstr("error late-history")));
  EXPECT_THAT(read.message(), HasSubstr("T of \"/EStop/released:o\" is 500ms"));
  EXPECT_THAT(check(dds(in("/nav", "/Nav/cmd:o", "durability='transient_local'"))).findings(),
              ElementsAre(HasSubstr("error late-history")));
  EXPECT_THAT(check(dds(out("/cmd", "/Base/cmd:i", "qos='latched'"))).findings(), IsEmpty());
  const std::string bounded =
      "<in topic='/map' type='nav_msgs/msg/OccupancyGrid' "
      "port='/EStop/pressed:o' qos='latched' max_age='1s'/>";
  EXPECT_THAT(check(dds(bounded), all_forever).message(), HasSubstr("has a max_age="));
}

TEST(CheckMapping, APortHasOneEntry) {
  const Read read = check(dds(in("/a", "/Nav/cmd:o") + in("/b", "/Nav/cmd:o")));
  ASSERT_EQ(read.findings().size(), 1u);
  EXPECT_THAT(read.message(), HasSubstr("has an entry already, at mapping.xml:1:74"));
}

TEST(CheckMapping, APortThatTheModelDoesNotMentionIsFound) {
  const Read read = check(dds(in("/nav", "/Nav/cmmd:o") + out("/cmd", "/Bas/cmd:i")));
  ASSERT_EQ(read.findings().size(), 2u);
  EXPECT_EQ(read.diagnostics.items()[0].code, "unmentioned-port");
  EXPECT_THAT(read.message(0), HasSubstr("did you mean \"/Nav/cmd:o\"?"));
  EXPECT_THAT(read.message(1), HasSubstr("did you mean \"/Base/cmd:i\"?"));
  EXPECT_THAT(read.message(1), HasSubstr("so that nothing but the idle sample comes of it; did"));
  const std::string silent = "<out topic='/x' type='a/msg/B' port='/x:i' idle='none'/>";
  EXPECT_THAT(check(dds(silent)).message(1), HasSubstr("so that nothing comes of it; "));
}

// What was refused is not in an entry, and would seem to be wrong for another reason.
TEST(CheckMapping, AnEntryWithErrorsIsNotLookedAtAnyMore) {
  const std::string topic = "service='a' instance='b' event='' ";
  Read read = read_iceoryx("<in " + topic + "port='/Nav/cmd:o'/><out " + topic +
                           "port='/Base/cmd:i' idle='zero'/>");
  const std::vector<std::string> before = read.findings();
  EXPECT_THAT(before, testing::Not(IsEmpty()));
  check_mappings({read.mapping}, nullptr, read.diagnostics);
  EXPECT_EQ(read.findings(), before);
}

TEST(CheckMapping, AnEntryIsAtTheRightEnd) {
  const Read read = check(dds(in("/nav", "/Base/cmd:i") + out("/cmd", "/Nav/cmd:o")));
  ASSERT_EQ(read.findings().size(), 2u);
  EXPECT_THAT(read.message(0), HasSubstr("is an input port in the model"));
  EXPECT_THAT(read.message(1), HasSubstr("is an output port in the model"));
}

TEST(CheckMapping, NothingIsSentToWhoeverMustStopByItself) {
  const Read read = check(dds("<out topic='/c' type='a/msg/B' port='/Base/cmd:i'/>"));
  ASSERT_EQ(read.findings().size(), 1u);
  EXPECT_THAT(read.findings()[0], HasSubstr("note no-idle"));
  EXPECT_THAT(read.message(0), HasSubstr("add idle=\"zero\", or a sample"));
  // It would be refused.
  const Read stamped =
      check(dds("<out topic='/c' type='nav_msgs/msg/Odometry' port='/Base/cmd:i'/>"));
  ASSERT_EQ(stamped.findings().size(), 1u);
  EXPECT_THAT(stamped.message(0), HasSubstr("add a sample that says stop: idle=\"file:…\""));
}

std::string with_estop(const std::string& condition, const std::string& released) {
  return "<behaviors><source port='/pressed:o' timeout='forever'/>"
         "<source port='/released:o' timeout='" +
         released +
         "'/>"
         "<behavior name='Drive'><config at='/Base/cmd:i'>/Nav/cmd:o</config><condition>" +
         condition + "</condition></behavior></behaviors>";
}

TEST(CheckMapping, ABooleanThatAConditionAsksForMustNotLastForEver) {
  const std::string mapping =
      dds("<in topic='/estop' type='std_msgs/msg/Bool' true='/pressed:o' false='/released:o'/>");
  const auto codes = [&](const std::string& condition, const std::string& timeout) {
    std::vector<std::string> result;
    const Read read = check(mapping, with_estop(condition, timeout));
    for (const auto& item : read.diagnostics.items()) {
      result.push_back(item.code + " " + item.about.source);
    }
    return result;
  };
  const std::string found = "forever-choice /released:o";
  EXPECT_THAT(codes("/released:o and not /pressed:o", "200ms"), IsEmpty());
  EXPECT_THAT(codes("/released:o and not /pressed:o", "forever"), ElementsAre(found));
  EXPECT_THAT(codes("not (/pressed:o or not /released:o)", "forever"), ElementsAre(found));
  EXPECT_THAT(codes("/pressed:o implies /released:o", "forever"), ElementsAre(found));
  EXPECT_THAT(codes("/pressed:o iff /released:o", "200ms"),
              ElementsAre("forever-choice /pressed:o"));
  EXPECT_THAT(codes("all(/released*)", "forever"), ElementsAre(found));
}

// It would command for ever.
TEST(CheckMapping, ABooleanThatCommandsMustNotLastForEver) {
  const Read read = check(
      dds("<in topic='/go' type='std_msgs/msg/Bool' true='/Go/yes:o'/>"),
      "<behaviors><source port='/Go/yes:o' timeout='forever'/>"
      "<behavior name='Go'><config at='/Base/go:i'>/Go/yes:o</config></behavior></behaviors>");
  EXPECT_THAT(read.findings(), ElementsAre(HasSubstr("error forever-choice")));
}

// A stop that is pressed would count as released: both are messages.
TEST(CheckMapping, ABooleanThatIsOnlyReadSaysWhichOfItsValuesCounts) {
  const std::string model = with_estop("/released:o and not /pressed:o", "200ms");
  const auto in = [](const std::string& type, const std::string& way) {
    return dds("<in topic='/estop' type='" + type + "' " + way + "='/released:o'/>");
  };
  const Read read = check(in("std_msgs/msg/Bool", "port"), model);
  ASSERT_EQ(read.findings().size(), 1u);
  EXPECT_THAT(read.findings()[0], HasSubstr("warning either-way"));
  EXPECT_THAT(read.message(0), HasSubstr("makes \"/released:o\" active, whether it says true or "
                                         "false; write true="));
  EXPECT_THAT(check(in("std_msgs/msg/Bool", "false"), model).findings(), IsEmpty());
  EXPECT_THAT(check(in("std_msgs/msg/Empty", "port"), model).findings(), IsEmpty());
  const std::string connected =
      "<behaviors><arbiter at='/Light:i'><select from='/released:o'/></arbiter></behaviors>";
  EXPECT_THAT(check(in("std_msgs/msg/Bool", "port"), connected).findings(), IsEmpty());
}

TEST(CheckMapping, TypesOfConnectedEndsAgree) {
  const Read read =
      check(dds("<in topic='/nav' type='geometry_msgs/msg/TwistStamped' port='/Nav/cmd:o'/>" +
                out("/cmd", "/Base/cmd:i")));
  ASSERT_EQ(read.findings().size(), 1u);
  EXPECT_THAT(read.message(), HasSubstr("brings geometry_msgs/msg/TwistStamped, and DDS topic "
                                        "rt/cmd takes geometry_msgs/msg/Twist;"));
  const std::string untyped =
      "<gateway kind='iceoryx'><in service='a' instance='b' event='c' "
      "port='/Nav/cmd:o'/></gateway>";
  EXPECT_THAT(check(untyped + dds(out("/cmd", "/Base/cmd:i"))).message(),
              HasSubstr("brings samples without a type"));
}

std::string iceoryx(const std::string& entries) {
  return "<gateway kind='iceoryx'>" + entries + "</gateway>";
}
std::string chunks_in(const std::string& more) {
  return "<in service='a' instance='b' event='nav' port='/Nav/cmd:o' " + more + "/>";
}
std::string chunks_out(const std::string& more) {
  return "<out service='a' instance='b' event='cmd' port='/Base/cmd:i' idle='zero' size='8' " +
         more + "/>";
}

// They would not be connected.
TEST(CheckMapping, AlignmentsOfConnectedTypesAgree) {
  const std::string type = "type='T' alignment=";
  const std::string other =
      "<out service='a' instance='b' event='cmd' port='/Base/cmd:i' "
      "idle='zero' size='8' type='T' alignment='16'/>";
  EXPECT_THAT(check(iceoryx(chunks_in(type + "'16' size='8'") + other)).findings(), IsEmpty());
  EXPECT_THAT(check(iceoryx(chunks_in(type + "'8' size='8'") + other)).findings(),
              ElementsAre(HasSubstr("error types-differ")));
}

// Else bytes of the header would be the command.
TEST(CheckMapping, HeadersOfConnectedEndsAgree) {
  const auto codes = [](const std::string& mapping) {
    std::vector<std::string> result;
    const Read read = check(mapping);
    for (const auto& item : read.diagnostics.items()) result.push_back(item.code);
    return result;
  };
  const std::string header = "user_header='8'";
  EXPECT_THAT(codes(iceoryx(chunks_in("") + chunks_out(""))), IsEmpty());
  EXPECT_THAT(codes(iceoryx(chunks_in(header) + chunks_out(header))), IsEmpty());
  EXPECT_THAT(codes(iceoryx(chunks_in("alignment='64'") + chunks_out(""))), IsEmpty());
  const Read read = check(iceoryx(chunks_in(header) + chunks_out("")));
  ASSERT_THAT(read.findings(), ElementsAre("1:101 error headers-differ"));
  EXPECT_THAT(read.message(),
              HasSubstr("iceoryx a/b/nav (mapping.xml:1:25) brings samples with a user header of 8 "
                        "bytes, and iceoryx a/b/cmd sends samples with no user header:"));
  EXPECT_THAT(read.message(), testing::EndsWith("; write user_header=\"8\" at the <out>"));
  EXPECT_THAT(check(iceoryx(chunks_in("") + chunks_out(header))).message(),
              testing::EndsWith("; remove user_header=\"…\" at the <out>"));
  // The payload begins elsewhere.
  EXPECT_THAT(check(iceoryx(chunks_in(header + " alignment='64'") + chunks_out(header))).message(),
              testing::EndsWith("; write user_header=\"8\" alignment=\"64\" at the <out>"));
  // Nor does a type say where it begins: 8 and 8 bytes are as many as 16.
  EXPECT_THAT(codes(iceoryx(chunks_in(header + " type='T' size='8'") +
                            "<out service='a' instance='b' event='cmd' port='/Base/cmd:i' "
                            "idle='zero' type='T' size='16'/>")),
              ElementsAre("headers-differ"));
}

TEST(CheckMapping, ASampleOfDdsHasNoUserHeader) {
  const std::string nav = dds(in("/nav", "/Nav/cmd:o"));
  EXPECT_THAT(check(nav + iceoryx(chunks_out(""))).findings(), IsEmpty());
  EXPECT_THAT(check(nav + iceoryx(chunks_out("user_header='4'"))).findings(),
              ElementsAre(HasSubstr("error headers-differ")));
  const std::string serialised = "type='geometry_msgs/msg/Twist' max_size='64'";
  const std::string base = dds(out("/cmd", "/Base/cmd:i"));
  EXPECT_THAT(check(iceoryx(chunks_in(serialised)) + base).findings(), IsEmpty());
  EXPECT_THAT(check(iceoryx(chunks_in(serialised + " user_header='4'")) + base).message(),
              testing::EndsWith("; DDS has no user headers: connect a topic without one"));
}

}  // namespace
}  // namespace arbiter::gateway
