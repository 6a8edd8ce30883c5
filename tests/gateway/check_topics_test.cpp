// Topics of mappings beside each other.
#include <gmock/gmock.h>

#include <cstdlib>
#include <string>

#include "tests/gateway/check_scene.hpp"

namespace arbiter::gateway {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(CheckTopics, ATopicThatComesInAgainIsACircle) {
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
TEST(CheckTopics, ADomainThatIsNotNamedIsTheEnvironments) {
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
TEST(CheckTopics, AProgramHasOneConfigurationForADomain) {
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

TEST(CheckTopics, TwoPortsThatCommandOneTopicAreNotArbitratedAgainstEachOther) {
  const Read read = check(dds(out("/cmd", "/a:i") + out("/cmd", "/b:i")), "");
  ASSERT_EQ(read.diagnostics.items().size(), 1u);
  EXPECT_EQ(read.diagnostics.items()[0].code, "two-outs");
  EXPECT_EQ(read.diagnostics.items()[0].about.ports, std::vector<std::string>{"/b:i"});
}

TEST(CheckTopics, OfManyThatCommandOneTopicEachIsFoundOnce) {
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
TEST(CheckTopics, PartitionsThatTakeTooLongToCompareAreRefused) {
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

}  // namespace
}  // namespace arbiter::gateway
