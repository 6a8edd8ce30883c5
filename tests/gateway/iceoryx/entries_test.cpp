// Which entries a gateway serves: ports that are taken, mappings that change, full file systems.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <fstream>
#include <optional>
#include <string>

#include "tests/gateway/iceoryx/scene.hpp"

namespace arbiter::test {
namespace {

TEST_F(Iceoryx, APortThatSomebodyElseHasIsWaitedForAndTheOthersAreServed) {
  const Roudi roudi(directory_);
  std::optional<Node> other("other");
  std::optional<OutputPort<void>> taken(other->output_port("/High:o"));
  Spoken gate =
      gateway(directory_, in("low", "/Low:o") + in("high", "/High:o") + out("/Base:i", "base"));
  ASSERT_TRUE(gate.hear("/High:o is not served: the output port /High:o is held by node \"other\""))
      << gate.heard;
  Spoken low = plain_publisher("low");
  Spoken high = plain_publisher("high");
  Spoken subscriber = plain_subscriber("base");
  ASSERT_TRUE(subscriber.hear("ready"));
  wait_for_description("/Low:o", "1 publisher matched");
  low.say("low");
  ASSERT_TRUE(subscriber.hear("|low"));
  taken.reset();
  ASSERT_TRUE(gate.hear("/High:o is served now")) << gate.heard;
  EXPECT_EQ(gate.heard.find("is not served"), std::string::npos) << gate.heard;
  wait_for_description("/High:o", "1 publisher matched");
  high.say("high");
  EXPECT_TRUE(subscriber.hear("|high"));
}

TEST_F(Iceoryx, APublisherThatRouDiRefusesIsTriedAgainAndTheOthersAreServed) {
  const Roudi roudi(directory_);
  Spoken crowd({ARBITER_TESTS "/plain_iceoryx_crowd"});
  ASSERT_TRUE(crowd.hear("ready"));
  Spoken gate = gateway(directory_, in("low", "/Low:o") + out("/Base:i", "base"));
  ASSERT_TRUE(gate.hear("RouDi refuses the publisher of iceoryx Test/One/base: ")) << gate.heard;
  wait_for_description("/Low:o", "no publisher matched");
  const pid_t worker = worker_of("/Low:o");
  wait_until([&] {
    return described_input("/Base:i").find("RouDi refuses the publisher: ") != std::string::npos;
  });
  crowd.process.kill();
  ASSERT_TRUE(gate.hear("iceoryx Test/One/base is served now")) << gate.heard;
  expect_that_samples_pass();
  EXPECT_EQ(worker_of("/Low:o"), worker);
}

TEST_F(Iceoryx, APortThatIsTakenUpLaterIsToldToStop) {
  const Roudi roudi(directory_);
  std::optional<Node> other("other");
  std::optional<InputPort<void>> taken(other->input_port("/Base:i"));
  Spoken gate =
      gateway(directory_, in("low", "/Low:o") + out("/Base:i", "base", "size='4' idle='zero'"));
  ASSERT_TRUE(gate.hear("/Base:i is not served")) << gate.heard;
  Spoken subscriber = plain_subscriber("base");
  ASSERT_TRUE(subscriber.hear("ready"));
  taken.reset();
  EXPECT_EQ(subscriber.line(), "|zeros 4");
}

TEST_F(Iceoryx, AnotherMappingIsTakenUpWithoutRouDi) {
  Spoken gate = gateway(directory_, in("low", "/Low:o"));
  wait_for_description("/Low:o", "RouDi does not run");
  write_mapping(directory_, in("high", "/High:o") + out("/Base:i", "base"));
  gate.process.signal(SIGUSR1);
  ASSERT_TRUE(gate.hear("the mapping was read again")) << gate.heard;
  wait_for_description("/High:o", "RouDi does not run");
  EXPECT_FALSE(daemon_.source("/Low:o")["open"]);
  const Roudi roudi(directory_);
  Spoken publisher = plain_publisher("high");
  Spoken subscriber = plain_subscriber("base");
  ASSERT_TRUE(subscriber.hear("ready"));
  wait_for_description("/High:o", "1 publisher matched");
  publisher.say("x");
  EXPECT_EQ(subscriber.line(), "|x");
}

// Nor does the next worker read what is bad.
TEST_F(Iceoryx, ABadMappingChangesNothingAndSaysWhereItIsBad) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o") + out("/Base:i", "base"));
  wait_for_description("/Low:o", "no publisher matched");
  const pid_t worker = worker_of("/Low:o");
  directory_.write("gateway.xml", "<gateway kind='iceoryx'>\n  <in service='Test'/>\n</gateway>");
  gate.process.signal(SIGUSR1);
  ASSERT_TRUE(gate.hear("gateway.xml:2:3: error: ")) << gate.heard;
  ASSERT_TRUE(gate.hear("the mapping was not read again: the one before stays")) << gate.heard;
  EXPECT_EQ(worker_of("/Low:o"), worker);
  ::kill(worker, SIGKILL);
  wait_for_another_worker("/Low:o", worker);
  expect_that_samples_pass();
}

TEST_F(Iceoryx, AnIdleSampleWhoseFileHasGoneIsSentAllTheSame) {
  const Roudi roudi(directory_);
  directory_.write("stop.bin", "stop");
  Spoken gate =
      gateway(directory_, in("low", "/Low:o") + out("/Base:i", "base", "idle='file:stop.bin'"));
  wait_for_description("/Low:o", "no publisher matched");
  ASSERT_EQ(::unlink(directory_.file("stop.bin").c_str()), 0);
  const pid_t worker = worker_of("/Low:o");
  ::kill(worker, SIGKILL);
  wait_for_another_worker("/Low:o", worker);
  Spoken subscriber = plain_subscriber("base");
  EXPECT_TRUE(subscriber.hear("|stop"));
}

// Nobody can be sure that a mapping which is being edited is good at that moment.
TEST_F(Iceoryx, AMistakeInTheMappingKeepsNobodyFromStoppingTheRobot) {
  const Roudi roudi(directory_);
  const std::string mapping = write_mapping(
      directory_, in("low", "/Low:o") + out("/Base:i", "base", "size='4' idle='zero'"));
  const std::string program = ARBITER_PROGRAMS "/arbiter-gateway-iceoryx";
  const std::string copy = directory_.file("copy");
  Spoken gate({program, "--copy", copy, mapping});
  wait_for_description("/Low:o", "no publisher matched");
  gate.process.signal(SIGKILL);
  gate.process.wait();
  write_mapping(directory_, "<in service='Test'/>");
  Spoken subscriber = plain_subscriber("base");
  ASSERT_TRUE(subscriber.hear("ready"));
  Spoken after({program, "--send-idle", "--copy", copy, mapping});
  EXPECT_TRUE(subscriber.hear("|zeros 4"));
  EXPECT_EQ(after.process.wait(), 0);
}

// By that of the mapping before, the robot would not be told that the gateway has driven since.
TEST_F(Iceoryx, ACopyThatCannotBeRenewedIsNotGoneBy) {
  const Roudi roudi(directory_);
  const std::string zeros = "size='4' idle='zero'";
  const std::string mapping =
      write_mapping(directory_, in("low", "/Low:o") + out("/Base:i", "base", zeros));
  const std::string program = ARBITER_PROGRAMS "/arbiter-gateway-iceoryx";
  const std::string copy = directory_.file("copy");
  Spoken gate({program, "--copy", copy, mapping});
  wait_for_description("/Low:o", "no publisher matched");
  // Where it is written first.
  ASSERT_EQ(::mkdir((copy + ".new").c_str(), 0700), 0);
  write_mapping(directory_, in("low", "/Low:o") + out("/Base:i", "other", zeros));
  gate.process.signal(SIGUSR1);
  ASSERT_TRUE(gate.hear("no copy of the mapping is kept: ")) << gate.heard;
  Spoken subscriber = plain_subscriber("other");
  ASSERT_TRUE(subscriber.hear("ready"));
  gate.process.signal(SIGKILL);
  gate.process.wait();
  Spoken after({program, "--send-idle", "--copy", copy, mapping});
  EXPECT_EQ(after.process.wait(), 0);
  while (const auto line = after.line()) after.heard += *line + "\n";
  EXPECT_THAT(after.heard, testing::Not(testing::HasSubstr("Test/One/base"))) << after.heard;
  EXPECT_THAT(after.heard, testing::HasSubstr("no copy of the mapping is good"));
}

// As many files as are there now, and that many more.
void leave_room_for(unsigned files) {
  struct statvfs room {};
  ASSERT_EQ(::statvfs("/tmp", &room), 0);
  const std::string limit = "nr_inodes=" + std::to_string(room.f_files - room.f_ffree + files);
  ASSERT_EQ(::mount("tmpfs", "/tmp", "tmpfs", MS_REMOUNT, limit.c_str()), 0);
}

// iceoryx makes two for each process.
TEST_F(Iceoryx, WithoutRoomForFilesTheGatewaySaysSoAndComesBackWhenThereIs) {
  const Roudi roudi(directory_);
  const std::string mapping =
      write_mapping(directory_, in("low", "/Low:o") + out("/Base:i", "base"));
  leave_room_for(0);
  Spoken gate({ARBITER_PROGRAMS "/arbiter-gateway-iceoryx", mapping});
  ASSERT_TRUE(gate.hear("iceoryx gives up: ")) << gate.heard;
  ASSERT_TRUE(gate.hear("another one is started in ")) << gate.heard;
  leave_room_for(1000);
  expect_that_samples_pass();
}

std::string many_ins(int count) {
  std::string entries;
  for (int i = 0; i < count; ++i) {
    entries += in("e" + std::to_string(i), "/p" + std::to_string(i) + ":o", "max_size='64'");
  }
  return entries;
}

Spoken gateway_with_descriptors(const std::string& limit, const std::string& mapping) {
  return Spoken({"/usr/bin/prlimit", "--nofile=" + limit,
                 ARBITER_PROGRAMS "/arbiter-gateway-iceoryx", mapping});
}

// Each port needs three, and more for its connections; what shells and service managers give is
// made for less.
TEST_F(Iceoryx, AGatewayTakesTheDescriptorsThatItIsAllowed) {
  const Roudi roudi(directory_);
  Spoken gate = gateway_with_descriptors(
      "256:4096",
      write_mapping(directory_, many_ins(100) + in("low", "/Low:o") + out("/Base:i", "base")));
  EXPECT_TRUE(gate.hear("serves 101 topics in, 1 out")) << gate.heard;
  EXPECT_THAT(gate.heard, testing::Not(testing::HasSubstr("is not served")));
  expect_that_samples_pass();
}

// The last one does not go to a port: nothing would pass at all.
TEST_F(Iceoryx, PortsForWhichThereAreNoDescriptorsAreLeftOutAndTheOthersAreServed) {
  const Roudi roudi(directory_);
  Spoken gate = gateway_with_descriptors(
      "256:256",
      write_mapping(directory_, in("low", "/Low:o") + out("/Base:i", "base") + many_ins(100)));
  ASSERT_TRUE(
      gate.hear("/p99:o is not served: no descriptors are left for it: raise RLIMIT_NOFILE"))
      << gate.heard;
  expect_that_samples_pass();
  EXPECT_TRUE(gate.process.runs());
}

// Such a process may make no memory either, of which ports consist.
TEST_F(Iceoryx, AGatewayThatMayMakeNoFilesWaitsUntilItMay) {
  Spoken gate({"/usr/bin/prlimit", "--fsize=1000:unlimited",
               ARBITER_PROGRAMS "/arbiter-gateway-iceoryx",
               write_mapping(directory_, in("low", "/Low:o"))});
  ASSERT_TRUE(gate.hear("/Low:o is not served: ")) << gate.heard;
  pid_t worker = 0;
  const std::string pid = std::to_string(gate.process.pid());
  std::ifstream("/proc/" + pid + "/task/" + pid + "/children") >> worker;
  const rlimit all{RLIM_INFINITY, RLIM_INFINITY};
  ASSERT_EQ(::prlimit(worker, RLIMIT_FSIZE, &all, nullptr), 0);
  EXPECT_TRUE(gate.hear("/Low:o is served now")) << gate.heard;
}

}  // namespace
}  // namespace arbiter::test
