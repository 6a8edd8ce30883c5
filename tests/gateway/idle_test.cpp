// Idle samples: zeros where they are a sample, and those of files.
#include <gmock/gmock.h>

#include "tests/gateway/mapping_text.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::gateway {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(Mapping, ZerosAreNoSampleOfATypeWithStrings) {
  const auto out = [](const std::string& type, const std::string& more) {
    return read_dds("<out port='/a:i' topic='/a' type='" + type + "' idle='zero' " + more + "/>");
  };
  EXPECT_THAT(out("geometry_msgs/msg/TwistStamped", "size='80'").message(),
              HasSubstr("has a string in it"));
  EXPECT_THAT(out("geometry_msgs/msg/PoseWithCovarianceStamped", "size='368'").message(),
              HasSubstr("has a string in it"));
  for (const char* type : {"geometry_msgs/msg/TransformStamped", "nav_msgs/msg/Odometry"}) {
    EXPECT_THAT(out(type, "").message(), HasSubstr("has strings or sequences, of which zero"));
  }
  EXPECT_THAT(out("my_msgs/msg/Drive", "").message(),
              AllOf(HasSubstr("a zero \"my_msgs/msg/Drive\" is cannot be known; if it has"),
                    HasSubstr("add size=\"BYTES\"")));
  EXPECT_THAT(out("my_msgs/msg/Drive", "size='16'").findings(), IsEmpty());
  EXPECT_EQ(out("my_msgs/msg/Drive", "size='16'").entry().idle.sample.size(), 20u);
  EXPECT_THAT(out("geometry_msgs/msg/Twist", "size='44'").message(), HasSubstr("has 48 bytes"));
}

// A stamp of zero, and an empty frame, whose length counts its final zero.
TEST(Mapping, AZeroOfAStampedTypeHasAHeader) {
  const auto sample = [](const std::string& type, const std::string& more) {
    const Read read =
        read_dds("<out port='/a:i' topic='/a' type='" + type + "' idle='zero' " + more + "/>");
    EXPECT_THAT(read.findings(), IsEmpty());
    return read.entry().idle.sample;
  };
  std::vector<std::byte> expected(68);
  expected[1] = expected[12] = std::byte{1};
  EXPECT_EQ(sample("geometry_msgs/msg/TwistStamped", ""), expected);
  expected[1] = std::byte{7};
  EXPECT_EQ(sample("geometry_msgs/msg/TwistStamped", "representation='xcdr2'"), expected);
  EXPECT_EQ(sample("geometry_msgs/msg/PointStamped", "").size(), 44u);
}

TEST(Mapping, AnIdleSampleComesFromAFileBesideTheMapping) {
  const test::TemporaryDirectory directory;
  directory.write("stop.bin", std::string("\0\1\0\0stop", 8));
  directory.write("short.bin", "x");
  const std::string path = directory.path();
  const auto with = [&](const std::string& idle) {
    return read_text(
        "<gateway kind='dds'><out port='/a:i' topic='/a' type='my_msgs/msg/Drive' "
        "idle='" +
            idle + "'/></gateway>",
        &path);
  };
  EXPECT_EQ(with("file:stop.bin").entry().idle.sample.size(), 8u);
  EXPECT_THAT(with("file:short.bin").message(), HasSubstr("has 1 byte;"));
  EXPECT_THAT(with("file:none.bin").message(), HasSubstr("none.bin"));
  EXPECT_THAT(with("stop.bin").message(), HasSubstr("write none, zero, or file:"));
}

// Else nothing would stop the robot, and nobody would know before.
TEST(Mapping, AnIdleSampleOfAFileIsAsTheEntrySendsIt) {
  const test::TemporaryDirectory directory;
  directory.write("one.bin", std::string("\0\1\0\0stop", 8));
  directory.write("two.bin", std::string("\0\7\0\0stop", 8));
  directory.write("xml.bin", std::string("\0\4\0\0stop", 8));
  const std::string path = directory.path();
  const auto with = [&](const std::string& file, const std::string& more) {
    return read_text(
        "<gateway kind='dds'><out port='/a:i' topic='/a' type='my_msgs/msg/Drive' "
        "idle='file:" +
            file + "' " + more + "/></gateway>",
        &path);
  };
  EXPECT_THAT(with("one.bin", "").findings(), IsEmpty());
  EXPECT_THAT(with("two.bin", "representation='xcdr2'").findings(), IsEmpty());
  EXPECT_THAT(with("two.bin", "").message(), HasSubstr("is XCDR2"));
  EXPECT_THAT(with("one.bin", "representation='xcdr2'").message(), HasSubstr("is XCDR1"));
  EXPECT_THAT(with("xml.bin", "").message(), HasSubstr("encapsulation header"));
}

// A subscriber takes it for a sample of its type, and may read past its end.
TEST(Mapping, AnIdleSampleOfAFileHasTheSizeOfItsType) {
  const test::TemporaryDirectory directory;
  const std::string path = directory.path();
  const std::string header("\0\1\0\0", 4);
  directory.write("bool.bin", header + "0");
  directory.write("padded.bin", header + "0000");
  directory.write("long.bin", header + "00000");
  directory.write("plain.bin", "00000000");
  const auto dds = [&](const std::string& file, const std::string& more = "") {
    return read_text(
        "<gateway kind='dds'><out port='/a:i' topic='/a' type='std_msgs/msg/Bool' "
        "idle='file:" +
            file + "' " + more + "/></gateway>",
        &path);
  };
  EXPECT_THAT(dds("bool.bin").findings(), IsEmpty());
  EXPECT_THAT(dds("padded.bin").findings(), IsEmpty());
  EXPECT_THAT(dds("long.bin").message(),
              HasSubstr("has 9 bytes; a sample has 4 of headers and 1 of its own"));
  EXPECT_THAT(dds("plain.bin").message(), HasSubstr("encapsulation header of DDS"));
  directory.write("delimited.bin", std::string("\0\x9\0\0\1\0\0\0"
                                               "0",
                                               9));  // XCDR2, appendable
  EXPECT_THAT(dds("delimited.bin", "representation='xcdr2'").findings(), IsEmpty());
  directory.write("long2.bin", std::string("\0\7\0\0", 4) + "00000");
  EXPECT_THAT(dds("long2.bin", "representation='xcdr2'").message(), HasSubstr("has 9 bytes;"));
  const auto iceoryx = [&](const std::string& size) {
    return read_text(
        "<gateway kind='iceoryx'><out port='/a:i' service='a' instance='b' event='c' "
        "user_header='4' alignment='4' idle='file:plain.bin' " +
            size + "/></gateway>",
        &path);
  };
  EXPECT_THAT(iceoryx("").findings(), IsEmpty());
  EXPECT_THAT(iceoryx("size='4'").findings(), IsEmpty());
  EXPECT_THAT(iceoryx("size='8'").findings(), ElementsAre("1:113 error idle-size"));
  directory.write("empty.bin", "");
  EXPECT_THAT(read_text("<gateway kind='iceoryx'><out port='/a:i' service='a' instance='b' "
                        "event='c' idle='file:empty.bin'/></gateway>",
                        &path)
                  .message(),
              HasSubstr("has 0 bytes; a sample to be sent while the port is idle has 1 to"));
}

}  // namespace
}  // namespace arbiter::gateway
