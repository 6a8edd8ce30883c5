// Why ends do not match: each policy, from both sides.
#include "gateway/dds/mismatch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/dds/quota.hpp"

namespace arbiter::gateway::dds {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

DdsTopic topic() {
  DdsTopic result;
  result.name = "rt/t";
  result.type = "T";
  return result;
}

// One that matches an entry of default QoS.
Peer peer(End end) {
  Peer result;
  result.end = end;
  result.topic = "rt/t";
  result.type = "T";
  result.qos = announced_by(Qos{}, end);
  return result;
}

TEST(Mismatch, EqualEndsMatch) {
  EXPECT_THAT(mismatches({End::kReader, topic(), false}, peer(End::kWriter)), IsEmpty());
  EXPECT_THAT(mismatches({End::kWriter, topic(), false}, peer(End::kReader)), IsEmpty());
}

TEST(Mismatch, WhoAsksForMoreThanIsOfferedDoesNotMatchAndWhoAsksForLessDoes) {
  DdsTopic weak = topic();
  weak.qos.reliability = Reliability::kBestEffort;
  EXPECT_THAT(mismatches({End::kReader, weak, false}, peer(End::kWriter)), IsEmpty());
  EXPECT_THAT(mismatches({End::kWriter, weak, false}, peer(End::kReader)),
              ElementsAre("reliability: this entry offers best_effort, the reader asks for "
                          "reliable; write reliability=\"reliable\""));
  Peer writer = peer(End::kWriter);
  writer.qos.reliability = 0;
  EXPECT_THAT(mismatches({End::kReader, topic(), false}, writer),
              ElementsAre("reliability: the writer offers best_effort, this entry asks for "
                          "reliable; write reliability=\"best_effort\""));
}

TEST(Mismatch, ADurabilityThatTheMappingDoesNotHaveHasNoRemedy) {
  Peer reader = peer(End::kReader);
  reader.qos.durability = 3;
  EXPECT_THAT(
      mismatches({End::kWriter, topic(), false}, reader),
      ElementsAre("durability: this entry offers volatile, the reader asks for persistent"));
}

TEST(Mismatch, PoliciesThatNoAttributeChangesAreNamedToo) {
  Peer reader = peer(End::kReader);
  reader.qos.ownership = 1;
  reader.qos.liveliness = 2;
  reader.qos.lease = 1'000'000'000;
  reader.qos.destination_order = 1;
  EXPECT_THAT(
      mismatches({End::kWriter, topic(), false}, reader),
      ElementsAre("ownership: this entry offers shared, the reader asks for exclusive",
                  "liveliness: this entry offers automatic, the reader asks for manual_by_topic",
                  "liveliness lease: this entry offers none, the reader asks for 1000 ms",
                  "destination order: this entry offers by reception, the reader asks for by "
                  "source time"));
}

TEST(Mismatch, AWriterThatMayBeLateIsNamedToo) {
  Peer writer = peer(End::kWriter);
  writer.qos.latency_budget = 1'000'000'000;
  EXPECT_THAT(mismatches({End::kReader, topic(), false}, writer),
              ElementsAre("latency budget: the writer offers 1000 ms, this entry asks for 0 ms"));
}

TEST(Mismatch, TypesOfRos2HaveTheNamesThatTheMappingGivesThem) {
  DdsTopic ours = topic();
  ours.is_ros = true;
  ours.type = "geometry_msgs::msg::dds_::Twist_";
  ours.type_written = "geometry_msgs/msg/Twist";
  Peer other = peer(End::kWriter);
  other.type = "std_msgs::msg::dds_::Bool_";
  EXPECT_THAT(mismatches({End::kReader, ours, false}, other),
              ElementsAre("type: it has std_msgs/msg/Bool, this entry has geometry_msgs/msg/Twist; "
                          "if its type is right, write type=\"std_msgs/msg/Bool\""));
  other.type = "robot::Pose";
  EXPECT_THAT(mismatches({End::kReader, ours, false}, other),
              ElementsAre("type: it has robot::Pose, this entry has geometry_msgs/msg/Twist; if "
                          "its type is right, write type=\"robot::Pose\" and topic=\"rt/t\""));
}

// Numbers of a kind that no release knows are a stranger's, too.
TEST(Mismatch, ValuesThatNobodyKnowsAreSaidToBeUnknown) {
  Peer reader = peer(End::kReader);
  reader.qos.reliability = 77;
  EXPECT_THAT(mismatches({End::kWriter, topic(), false}, reader),
              ElementsAre(HasSubstr("something unknown")));
}

TEST(Mismatch, ARepresentationIsTheWritersToOffer) {
  Peer reader = peer(End::kReader);
  reader.qos.representations = {2};
  EXPECT_THAT(mismatches({End::kWriter, topic(), false}, reader),
              ElementsAre(HasSubstr("representation: this entry offers XCDR1, the reader asks for "
                                    "XCDR2")));
  Peer writer = peer(End::kWriter);
  writer.qos.representations = {2, 0};
  EXPECT_THAT(mismatches({End::kReader, topic(), false}, writer), IsEmpty());
  writer.qos.representations = {1};
  EXPECT_EQ(mismatches({End::kReader, topic(), false}, writer),
            std::vector<std::string>{"representation: the writer offers XML, this entry asks for "
                                     "XCDR1 or XCDR2"})
      << "of <in> the mapping has no such attribute";
}

TEST(Mismatch, TypesAndKeysAreCompared) {
  Peer writer = peer(End::kWriter);
  writer.type = "U";
  writer.keyed = true;
  EXPECT_THAT(
      mismatches({End::kReader, topic(), false}, writer),
      ElementsAre("type: it has U, this entry has T; if its type is right, write type=\"U\"",
                  HasSubstr("write keyed=\"true\"")));
}

// Names without end are not all looked at: any may be among the others.
TEST(Partition, AmongVeryManyAnyMayBe) {
  const CycloneQos qos(dds_create_qos());
  std::vector<std::string> names;
  std::vector<const char*> pointers;
  for (int i = 0; i < 100; ++i) names.push_back("p" + std::to_string(i));
  for (const std::string& name : names) pointers.push_back(name.c_str());
  const auto announced = [&](std::uint32_t count) {
    dds_qset_partition(qos.get(), count, pointers.data());
    return read_announced(*qos);
  };
  Qos ours;
  ours.partitions = {"p99"};
  EXPECT_TRUE(may_meet(ours, announced(100)));
  EXPECT_FALSE(may_meet(ours, announced(64)));
  EXPECT_LE(announced(100).partitions.size(), 64U);
}

TEST(Representations, OfWhichThereAreVeryManyAreNotAllLookedAt) {
  const CycloneQos qos(dds_create_qos());
  std::vector<dds_data_representation_id_t> many;
  for (dds_data_representation_id_t i = 0; i < 10'000; ++i) many.push_back(i);
  dds_qset_data_representation(qos.get(), static_cast<std::uint32_t>(many.size()), many.data());
  EXPECT_LE(read_announced(*qos).representations.size(), 8U);
}

// Hundreds of strangers may have made them so, and the gateway's loop compares them.
TEST(Partition, AmongThoseThatTakeTooLongToCompareAnyMayBe) {
  std::string slow = "*";
  for (int i = 0; i < 120; ++i) slow += "a*";
  Qos ours;
  ours.partitions = {std::string(230, 'a')};
  AnnouncedQos theirs;
  theirs.partitions.assign(64, slow + "b");
  EXPECT_TRUE(may_meet(ours, theirs));
  for (int i = 0; i < 64; ++i) ours.partitions.push_back("ours" + std::to_string(i));
  theirs.partitions.clear();
  for (int i = 0; i < 64; ++i) theirs.partitions.push_back("theirs" + std::to_string(i));
  EXPECT_FALSE(may_meet(ours, theirs)) << "as many as there may be, of some bytes each";
}

TEST(Peers, TheLastByteOfAGuidSaysWhetherThereIsAKey) {
  Guid guid{};
  const auto with = [&](std::uint8_t kind) {
    guid[15] = kind;
    return has_key(guid);
  };
  EXPECT_TRUE(with(0x02));
  EXPECT_TRUE(with(0x07));
  EXPECT_FALSE(with(0x03));
  EXPECT_FALSE(with(0x04));
}

TEST(Peers, ATypeHashStandsInTheUserData) {
  const std::string hash = "RIHS01_" + std::string(62, '0') + "af";
  EXPECT_EQ(type_hash_in("typehash=" + hash + ";"), hash);
  EXPECT_EQ(type_hash_in("enclave=/;typehash=" + hash + ";"), hash);
  EXPECT_EQ(type_hash_in("typehash=" + hash), hash);
  EXPECT_EQ(type_hash_in("atypehash=" + hash + ";"), "");
  EXPECT_EQ(type_hash_in(""), "");
  EXPECT_EQ(type_hash_in(";;=;"), "");
}

// Nodes of ROS 2 would warn of the gateway's ends, too, if these said it.
TEST(Peers, ATypeHashThatNoNodeCouldReadIsNone) {
  const std::string digits(64, '7');
  for (const std::string& hash :
       {std::string(), std::string("RIHS01_"), "RIHS01_" + digits.substr(1),
        "RIHS01_" + digits + "7", "RIHS01_" + digits.substr(1) + "g",
        "RIHS01_" + digits.substr(1) + "\n", "rihs01_" + digits, std::string(10'000, 'x')}) {
    EXPECT_EQ(type_hash_in("typehash=" + hash + ";"), "") << hash;
  }
}

TEST(Quota, LetsSoManyThroughAndCountsTheOthers) {
  Quota quota(2, 100);
  EXPECT_EQ(quota.take(1000), 0U);
  EXPECT_EQ(quota.take(1001), 0U);
  EXPECT_FALSE(quota.take(1002));
  EXPECT_FALSE(quota.take(1099));
  EXPECT_EQ(quota.take(1100), 2U);
  EXPECT_EQ(quota.take(1101), 0U);
  EXPECT_FALSE(quota.take(1102));
}

TEST(Quota, DoesNotCountWhatIsTriedAgain) {
  Quota quota(1, 100);
  EXPECT_TRUE(quota.take_without_count(1000));
  EXPECT_FALSE(quota.take_without_count(1001));
  EXPECT_FALSE(quota.take(1002));
  EXPECT_EQ(quota.take(1100), 1U);
}

}  // namespace
}  // namespace arbiter::gateway::dds
