// Mappings beside each other and beside a model.
#include <gmock/gmock.h>

#include <cstdlib>

#include "gateway/mapping/check_owners.hpp"
#include "rules/model/application_reader.hpp"
#include "rules/model/load.hpp"
#include "tests/gateway/mapping_text.hpp"

namespace arbiter::gateway {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kModel =
    "<behaviors timeout='500ms'>"
    "<source port='/EStop/pressed:o' timeout='forever'/>"
    "<behavior name='Drive'><config at='/Base/cmd:i'>/Nav/cmd:o</config>"
    "<condition>not /EStop/pressed:o</condition></behavior>"
    "</behaviors>";

// What is found of the entries of a gateway (its line 1), in that model; empty: without one.
Read check(const std::string& mapping, const std::string& model = kModel) {
  Read read = read_text(mapping);
  EXPECT_THAT(read.findings(), IsEmpty());
  if (model.empty()) {
    check_mappings({read.mapping}, nullptr, read.diagnostics);
    return read;
  }
  rules::Diagnostics of_model;
  rules::ModelTexts texts;
  texts.models.push_back({"model.xml", model});
  const rules::RuleSet rules = rules::load(std::move(texts), of_model);
  EXPECT_FALSE(of_model.has_errors());
  check_mappings({read.mapping}, &rules, read.diagnostics);
  return read;
}

std::string dds(const std::string& entries, const std::string& more = "") {
  return "<gateway kind='dds' " + more + ">" + entries + "</gateway>";
}

std::string in(const std::string& topic, const std::string& port, const std::string& more = "") {
  return "<in topic='" + topic + "' type='geometry_msgs/msg/Twist' port='" + port + "' " + more +
         "/>";
}
std::string out(const std::string& topic, const std::string& port, const std::string& more = "") {
  return "<out topic='" + topic + "' type='geometry_msgs/msg/Twist' port='" + port +
         "' idle='zero' " + more + "/>";
}

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

TEST(CheckMapping, ATopicThatComesInAgainIsACircle) {
  const auto codes = [](const std::string& mapping) {
    std::vector<std::string> result;
    const Read read = check(mapping, "");
    for (const auto& item : read.diagnostics.items()) result.push_back(item.code);
    return result;
  };
  const std::string both = in("/cmd", "/Nav/cmd:o") + out("/cmd", "/Base/cmd:i");
  EXPECT_THAT(codes(dds(both)), ElementsAre("circle"));
  EXPECT_THAT(codes(dds(in("/cmd", "/Nav/cmd:o"), "domain='1'") +
                    dds(out("/cmd", "/Base/cmd:i"), "domain='2'")),
              IsEmpty());
  EXPECT_THAT(codes(dds(in("/cmd", "/Nav/cmd:o")) + dds(out("/cmd", "/Base/cmd:i"), "domain='0'")),
              ElementsAre("circle"));
  const auto parted = [&](const std::string& one, const std::string& other) {
    return codes(dds(in("/cmd", "/Nav/cmd:o", "partition='" + one + "'") +
                     out("/cmd", "/Base/cmd:i", "partition='" + other + "'")));
  };
  EXPECT_THAT(parted("a", "b"), IsEmpty());
  EXPECT_THAT(parted("a", "b,a"), ElementsAre("circle"));
  EXPECT_THAT(parted("a*", "abc"), ElementsAre("circle"));
  const std::string end = " service='a' instance='b' event='c' ";
  EXPECT_THAT(codes("<gateway kind='iceoryx'><in" + end + "port='/a:o'/><out" + end +
                    "port='/b:i' size='1' idle='zero'/></gateway>"),
              ElementsAre("circle"));
}

// As at the start of the gateway, whose environment it is.
TEST(CheckMapping, ADomainThatIsNotNamedIsTheEnvironments) {
  const std::string mapping =
      dds(in("/cmd", "/Nav/cmd:o"), "domain='7'") + dds(out("/cmd", "/Base/cmd:i"));
  EXPECT_THAT(check(mapping).findings(), IsEmpty());
  ::setenv("ROS_DOMAIN_ID", "7", 1);
  EXPECT_THAT(check(mapping).findings(), ElementsAre(testing::HasSubstr("error circle")));
  ::setenv("ROS_DOMAIN_ID", "7x", 1);
  EXPECT_THAT(check(mapping).findings(), IsEmpty());
  ::unsetenv("ROS_DOMAIN_ID");
}

// A program would say so when it starts.
TEST(CheckMapping, AProgramHasOneConfigurationForADomain) {
  const std::string first = dds(in("/a", "/Nav/cmd:o"), "domain='3' interface='lo'");
  const auto second = [](const std::string& more) { return dds(in("/b", "/other:o"), more); };
  const auto findings = [](const std::string& mapping) { return check(mapping, "").findings(); };
  EXPECT_THAT(findings(first + second("domain='3' interface='lo'")), IsEmpty());
  EXPECT_THAT(findings(first + second("domain='4' interface='eth0'")), IsEmpty());
  for (const char* other : {"domain='3'", "domain='3' interface='lo' peers='10.0.0.1'",
                            "domain='3' interface='lo' configuration='x.xml'"}) {
    EXPECT_THAT(findings(first + second(other)), ElementsAre(HasSubstr("error two-configurations")))
        << other;
  }
  // Of two files nobody knows here whether one program is given both.
  Read one = read_text(first);
  const rules::TextFile file("second.xml", second("domain='3'"));
  const Mapping other = read_mapping(file, one.diagnostics);
  check_mappings({one.mapping, other}, nullptr, one.diagnostics);
  ASSERT_THAT(one.findings(), ElementsAre("1:1 warning two-configurations"));
  EXPECT_THAT(one.message(), HasSubstr("the gateway at mapping.xml:1:1 joins domain 3 with "));
}

TEST(CheckMapping, TwoPortsThatCommandOneTopicAreNotArbitratedAgainstEachOther) {
  const Read read = check(dds(out("/cmd", "/a:i") + out("/cmd", "/b:i")), "");
  ASSERT_EQ(read.diagnostics.items().size(), 1u);
  EXPECT_EQ(read.diagnostics.items()[0].code, "two-outs");
  EXPECT_EQ(read.diagnostics.items()[0].about.ports, std::vector<std::string>{"/b:i"});
}

TEST(CheckMapping, OfManyThatCommandOneTopicEachIsFoundOnce) {
  std::string outs;
  for (const char* port : {"/a:i", "/b:i", "/c:i", "/d:i"}) outs += out("/cmd", port);
  EXPECT_THAT(check(dds(outs), "").findings(), testing::SizeIs(3));
  const auto parted = [](const std::string& partition) { return "partition='" + partition + "'"; };
  const Read read =
      check(dds(in("/cmd", "/Nav/cmd:o", parted("c")) + out("/cmd", "/a:i", parted("a")) +
                out("/cmd", "/b:i", parted("a")) + out("/cmd", "/c:i", parted("a,c"))),
            "");
  std::vector<std::string> codes;
  for (const auto& item : read.diagnostics.items()) codes.push_back(item.code);
  EXPECT_THAT(codes, testing::UnorderedElementsAre("two-outs", "two-outs", "circle"));
}

// Somebody may have made them so that to compare each with each takes hours.
TEST(CheckMapping, PartitionsThatTakeTooLongToCompareAreRefused) {
  const auto partitions = [](const std::string& each) {
    std::string list = each;
    for (int i = 1; i < 64; ++i) list += "," + each;
    return "partition='" + list + "'";
  };
  std::string slow;
  for (int i = 0; i < 109; ++i) slow += "*a";
  std::string entries;
  for (int i = 0; i < 40; ++i) {
    const std::string number = std::to_string(i);
    entries += in("/cmd", "/in" + number + ":o", partitions(slow + "*b")) +
               out("/cmd", "/out" + number + ":i", partitions(std::string(230, 'a')));
  }
  std::vector<std::string> errors;
  const Read read = check(dds(entries), "");
  for (const auto& item : read.diagnostics.items()) {
    if (item.severity == rules::Severity::kError) errors.push_back(item.code);
  }
  EXPECT_THAT(errors, ElementsAre("too-many-partitions"));
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

// Who has the ports of kModel, beside an application with these modules. Warnings alone.
Read owners(const std::string& mapping, const std::string& modules) {
  Read read = read_text(mapping);
  EXPECT_THAT(read.findings(), IsEmpty());
  rules::Diagnostics ignored;
  rules::ModelTexts texts;
  texts.models.push_back({"model.xml", kModel});
  const rules::RuleSet rules = rules::load(std::move(texts), ignored);
  const rules::TextFile file("app.xml", "<application>\n" + modules + "</application>");
  const rules::Application application = rules::read_application(file, read.diagnostics);
  check_owners({read.mapping}, rules, application, read.diagnostics);
  return read;
}

std::string module_called(const std::string& name, const std::string& more = "") {
  return "<module><name>" + name + "</name>" + more + "</module>\n";
}

TEST(CheckOwners, EachPortHasOneOfAModuleAndAMapping) {
  const std::string nav = dds(in("/nav", "/Nav/cmd:o"));
  EXPECT_THAT(owners(nav, module_called("/Base")).findings(), IsEmpty());
  EXPECT_THAT(owners(nav, "").findings(), IsEmpty()) << "no modules: nothing is known";
}

TEST(CheckOwners, APortThatNobodyHasIsFound) {
  const Read read = owners(dds(in("/nav", "/Nav/cmd:o")), module_called("/Other"));
  ASSERT_THAT(read.findings(), ElementsAre(HasSubstr("warning no-owner")));
  EXPECT_THAT(read.message(), HasSubstr("/Base/cmd:i is in no mapping and belongs to no module"));
  EXPECT_THAT(owners(dds(in("/nav", "/Nav/cmmd:o")), module_called("/Base")).message(),
              HasSubstr("nobody publishes there; did you mean \"/Nav/cmmd:o\"?"));
}

// No application says whether a component has it.
TEST(CheckTakers, AnInputPortThatNoEntryTakesFromIsNoted) {
  rules::Diagnostics ignored;
  rules::ModelTexts texts;
  texts.models.push_back({"model.xml", kModel});
  const rules::RuleSet rules = rules::load(std::move(texts), ignored);
  Read without = read_text(dds(in("/nav", "/Nav/cmd:o")));
  check_takers({without.mapping}, rules, without.diagnostics);
  ASSERT_THAT(without.findings(), ElementsAre(HasSubstr("note no-taker")));
  EXPECT_THAT(without.message(), HasSubstr("no mapping takes what /Base/cmd:i gets"));
  Read with = read_text(dds(in("/nav", "/Nav/cmd:o") + out("/cmd", "/Base/cmd:i")));
  check_takers({with.mapping}, rules, with.diagnostics);
  EXPECT_THAT(with.findings(), IsEmpty());
}

TEST(CheckOwners, APortThatTwoHaveIsFound) {
  const std::string both = dds(in("/nav", "/Nav/cmd:o") + out("/cmd", "/Base/cmd:i"));
  const Read read = owners(both, module_called("/Nav"));
  ASSERT_THAT(read.findings(), ElementsAre("1:76 warning two-owners"));
  EXPECT_THAT(read.message(), HasSubstr("the module \"/Nav\" (app.xml:2:1) as well"));
  const std::string twins = module_called("/Base") + module_called("/Base");
  EXPECT_THAT(owners(dds(in("/nav", "/Nav/cmd:o")), twins).findings(),
              ElementsAre(HasSubstr("warning two-owners")));
  const std::string elsewhere =
      module_called("/Base", "<node>one</node>") + module_called("/Base", "<node>other</node>");
  EXPECT_THAT(owners(dds(in("/nav", "/Nav/cmd:o")), elsewhere).findings(), IsEmpty());
}

TEST(CheckOwners, AModuleMayStandForTheGateway) {
  const std::string both = dds(in("/nav", "/Nav/cmd:o") + out("/cmd", "/Base/cmd:i"));
  EXPECT_THAT(
      owners(both, module_called("arbiter-gateway-dds", "<prefix>/Nav</prefix>")).findings(),
      IsEmpty());
}

}  // namespace
}  // namespace arbiter::gateway
