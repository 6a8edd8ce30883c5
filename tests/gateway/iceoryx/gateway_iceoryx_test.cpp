// Real iceoryx: publishers and subscribers that know nothing of Arbiter, and how the gateway lives.
#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>

#include <arbiter/arbiter.hpp>

#include "shm/clock.hpp"
#include "tests/gateway/iceoryx/private_machine.hpp"
#include "tests/gateway/iceoryx/scene.hpp"

namespace arbiter::test {
namespace {

const std::string kZeros = "size='4' idle='zero'";

const auto* const machine = testing::AddGlobalTestEnvironment(new PrivateMachine);

TEST_F(Iceoryx, SamplesOfAnySizeGoThroughWithTheirHeaders) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o", "max_size='2MiB' user_header='12'") +
                                        out("/Base:i", "base", "user_header='12'"));
  Spoken publisher = plain_publisher("low", 12);
  Spoken subscriber = plain_subscriber("base");
  ASSERT_TRUE(subscriber.hear("ready"));
  wait_for_description("/Low:o", "1 publisher matched");
  for (const char* text : {"a", "twelve bytes"}) {
    publisher.say(text);
    EXPECT_EQ(subscriber.line(), std::string("hhhhhhhhhhhh|") + text);
  }
  for (const int size : {1000, 65536, 1 << 20}) {
    publisher.say("#" + std::to_string(size));
    EXPECT_EQ(subscriber.line(), "hhhhhhhhhhhh|" + std::to_string(size) + " bytes x");
  }
}

TEST_F(Iceoryx, TwoPublishersAreArbitratedIntoOneSubscriber) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(
      directory_, in("low", "/Low:o") + in("high", "/High:o") + out("/Base:i", "base", kZeros));
  Spoken low = plain_publisher("low");
  Spoken high = plain_publisher("high");
  Spoken subscriber = plain_subscriber("base");
  ASSERT_TRUE(subscriber.hear("|zeros 4")) << "nobody commands: stop";
  wait_for_description("/Low:o", "1 publisher matched");
  wait_for_description("/High:o", "1 publisher matched");
  low.say("low");
  ASSERT_TRUE(subscriber.hear("|low"));
  high.say("high");
  ASSERT_TRUE(subscriber.hear("|high"));
  low.say("overridden");
  ASSERT_TRUE(low.hear("published"));
  wait_until([&] { return daemon_.source("/Low:o")["discarded"] == 1; });
  high.say("again");
  EXPECT_EQ(subscriber.line(), "|again");
}

TEST_F(Iceoryx, AHeaderThatTheMappingDoesNotNameIsTold) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o"));
  Spoken publisher = plain_publisher("low", 8);
  wait_for_description("/Low:o", "1 publisher matched");
  publisher.say("x");
  wait_for_description("/Low:o",
                       "1 unreadable; chunks have a user header of 8 bytes; write "
                       "user_header=\"8\", also where <out> sends them on");
  EXPECT_EQ(daemon_.source("/Low:o")["published"], 0);
}

// What the model connects, this program does not know; the subscriber would take the header for the
// command.
TEST_F(Iceoryx, WhatBeginsWithAHeaderIsNotSentWithoutOne) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o", "user_header='8'") + in("high", "/High:o") +
                                        out("/Base:i", "base", kZeros));
  Spoken low = plain_publisher("low", 8);
  Spoken high = plain_publisher("high");
  Spoken subscriber = plain_subscriber("base");
  ASSERT_TRUE(subscriber.hear("|zeros 4"));
  wait_for_both_ends();
  wait_for_description("/High:o", "1 publisher matched");
  low.say("drive");
  wait_until([&] {
    return described_input("/Base:i").find(
               "1 unreadable; the last bad sample has a user header of 8 bytes; "
               "write user_header=\"8\" at the <out>") != std::string::npos;
  });
  high.say("stop");
  std::optional<std::string> line;
  while ((line = subscriber.line()) && line != "|stop") EXPECT_EQ(line, "|zeros 4");
  EXPECT_EQ(line, "|stop");
}

TEST_F(Iceoryx, AChunkThatIsTooLargeIsToldWithBothSizes) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o", "max_size='8'"));
  Spoken publisher = plain_publisher("low");
  wait_for_description("/Low:o", "1 publisher matched");
  publisher.say("#9");
  wait_for_description(
      "/Low:o", "1 of a size that does not fit; the last bad sample has 9 bytes; max_size is 8");
}

// Without a service manager nobody else would tell the robot.
TEST_F(Iceoryx, AGatewayThatBeginsAnewOrEndsStopsTheRobotThatItDrove) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o") + out("/Base:i", "base", kZeros));
  Spoken publisher = plain_publisher("low");
  Spoken subscriber = plain_subscriber("base");
  wait_for_both_ends();
  publisher.say("drive");
  ASSERT_TRUE(subscriber.hear("|drive"));
  const pid_t worker = worker_of("/Low:o");
  gate.process.signal(SIGUSR1);
  EXPECT_TRUE(subscriber.hear("|zeros 4"));
  wait_for_another_worker("/Low:o", worker);
  wait_for_both_ends();
  publisher.say("drive");
  ASSERT_TRUE(subscriber.hear("|drive"));
  gate.process.signal(SIGTERM);
  EXPECT_TRUE(subscriber.hear("|zeros 4"));
  EXPECT_EQ(gate.process.wait(), 0);
}

Spoken idle_sender(const TemporaryDirectory& directory, const std::string& entries) {
  const std::string mapping =
      directory.write("idle.xml", "<gateway kind='iceoryx'>" + entries + "</gateway>");
  return Spoken({ARBITER_PROGRAMS "/arbiter-gateway-iceoryx", "--send-idle", mapping});
}

TEST_F(Iceoryx, ForAGatewayThatHasDiedTheIdleSampleIsSent) {
  const Roudi roudi(directory_);
  const std::string entries = in("low", "/Low:o") + out("/Base:i", "base", kZeros);
  Spoken gate = gateway(directory_, entries);
  Spoken publisher = plain_publisher("low");
  Spoken subscriber = plain_subscriber("base");
  wait_for_both_ends();
  publisher.say("drive");
  ASSERT_TRUE(subscriber.hear("|drive"));
  gate.process.signal(SIGKILL);
  gate.process.wait();
  Spoken after = idle_sender(directory_, entries);
  EXPECT_TRUE(subscriber.hear("|zeros 4"));
  EXPECT_EQ(after.process.wait(), 0);
}

TEST_F(Iceoryx, TheIdleSampleIsNotWaitedForWithoutRouDi) {
  Spoken after = idle_sender(directory_, out("/Base:i", "base", kZeros));
  EXPECT_TRUE(after.hear("idle sample not sent"));
  EXPECT_EQ(after.process.wait(), 1);
}

TEST_F(Iceoryx, SamplesPassWhileNoDaemonRunsAndTheNextOneKnowsTheGateway) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o") + out("/Base:i", "base"));
  Spoken publisher = plain_publisher("low");
  Spoken subscriber = plain_subscriber("base");
  ASSERT_TRUE(subscriber.hear("ready"));
  wait_for_description("/Low:o", "1 publisher matched");
  daemon_.kill();
  publisher.say("x");
  EXPECT_EQ(subscriber.line(), "|x");
  daemon_.restart();
  wait_for_description("/Low:o", "1 publisher matched");
  publisher.say("y");
  EXPECT_EQ(subscriber.line(), "|y");
}

TEST_F(Iceoryx, ADaemonThatKnowsNobodyLetsTheGatewayInAgain) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o") + out("/Base:i", "base", kZeros));
  {
    Spoken publisher = plain_publisher("low");
    Spoken subscriber = plain_subscriber("base");
    wait_for_both_ends();
    publisher.say("drive");
    ASSERT_TRUE(subscriber.hear("|drive"));
    gate.process.stop();  // so that no other worker says it
    daemon_.terminate();
    daemon_.lose_state();
    daemon_.restart();
    ASSERT_TRUE(subscriber.hear("|zeros 4"));
    gate.process.resume();
  }
  ASSERT_TRUE(gate.hear("the state of the last daemon is lost; the gateway begins anew"));
  wait_for_description("/Low:o", "no publisher matched");
  Spoken publisher = plain_publisher("low");
  Spoken subscriber = plain_subscriber("base");
  wait_for_both_ends();
  publisher.say("drive");
  EXPECT_TRUE(subscriber.hear("|drive"));
}

TEST_F(Iceoryx, AGatewayThatIsStartedFirstWaitsForTheDaemon) {
  const Roudi roudi(directory_);
  daemon_.kill();
  Spoken gate = gateway(directory_, in("low", "/Low:o") + out("/Base:i", "base"));
  ASSERT_TRUE(gate.hear("no arbiterd of instance")) << gate.heard;
  daemon_.restart();
  expect_that_samples_pass();
}

// What it could watch at once is 256.
TEST_F(Iceoryx, MoreTopicsThanIceoryxCanWatchArriveAll) {
  const Roudi roudi(directory_);
  std::string entries;
  for (int i = 0; i < 260; ++i) {
    entries += in("e" + std::to_string(i), "/p" + std::to_string(i) + ":o", "max_size='64'");
  }
  Spoken gate = gateway(directory_, entries);
  ASSERT_TRUE(gate.hear("iceoryx can watch 256 topics at once; the others are looked at every"))
      << gate.heard;
  for (const char* last : {"0", "259"}) {
    Spoken publisher = plain_publisher("e" + std::string(last));
    const std::string source = "/p" + std::string(last) + ":o";
    wait_for_description(source, "1 publisher matched");
    publisher.say("x");
    wait_until([&] { return daemon_.source(source)["published"] == 1; });
  }
}

// The library has a line for each sample, past its own log, and they are ten a second.
TEST_F(Iceoryx, WithoutMemoryTheLogStaysShort) {
  const Roudi roudi(directory_, Roudi::kLittle);
  Spoken gate = gateway(directory_, out("/Base:i", "base", "size='4' idle='zero' history='16'") +
                                        out("/Large:i", "large", "size='4096' idle='zero'"));
  wait_until([&] {
    return described_input("/Base:i").find("exhausted, for 4 bytes") != std::string::npos &&
           described_input("/Large:i").find("no memory pool for chunks of 4096 bytes") !=
               std::string::npos;
  });
  gate.process.signal(SIGTERM);
  while (const auto line = gate.line()) {
    EXPECT_THAT(*line, testing::StartsWith("arbiter-gateway-iceoryx: "));
  }
}

TEST_F(Iceoryx, AWorkerThatDiesIsReplaced) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o"));
  wait_for_description("/Low:o", "no publisher matched");
  const pid_t worker = worker_of("/Low:o");
  EXPECT_NE(worker, gate.process.pid());
  const std::string trace = "/tmp/arbiter-gateway-iceoryx-" + std::to_string(worker);
  EXPECT_TRUE(std::filesystem::exists(trace));
  ::kill(worker, SIGKILL);
  ASSERT_TRUE(gate.hear("the worker was ended by signal 9 (Killed); another one is started"));
  EXPECT_FALSE(std::filesystem::exists(trace));
  wait_for_another_worker("/Low:o", worker);
  wait_for_description("/Low:o", "no publisher matched");
}

TEST_F(Iceoryx, AWorkerEndsWithItsSupervisor) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o"));
  wait_for_description("/Low:o", "no publisher matched");
  gate.process.kill();
  wait_until([&] { return daemon_.source("/Low:o")["open"] == false; });
}

// Also where RouDi, of which the library takes leave at the end, does not answer.
TEST_F(Iceoryx, AWorkerEndsWithoutItsSupervisorAndWithoutRouDi) {
  Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o"));
  wait_for_description("/Low:o", "no publisher matched");
  const pid_t worker = worker_of("/Low:o");
  roudi.process.stop();
  gate.process.kill();
  wait_until([&] {
    std::string line;
    std::getline(std::ifstream("/proc/" + std::to_string(worker) + "/stat"), line);
    return line.empty() || line.find(") Z ") != std::string::npos;
  });
}

// Returns when no thread of it runs any more.
void stop(pid_t process) {
  ::kill(process, SIGSTOP);
  wait_until([&] {
    for (const auto& task :
         std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
      std::string line;
      std::getline(std::ifstream(task.path() / "stat") >> std::ws, line);
      if (line.find(") T ") == std::string::npos) return false;
    }
    return true;
  });
}

// iceoryx gives way to what is newer, and tells only who asks. A worker that was stopped for too
// long is replaced, and the next one has lost nothing.
TEST_F(Iceoryx, WhatItsQueueLosesIsCounted) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o", "queue='1'"));
  Spoken publisher = plain_publisher("low");
  const auto is_told = [&] {
    return described("/Low:o").find(
               "1 or more lost to a full queue; its queue has lost samples; write a larger "
               "queue=") != std::string::npos;
  };
  while (!is_told()) {
    wait_for_description("/Low:o", "1 publisher matched");
    const pid_t worker = worker_of("/Low:o");
    stop(worker);
    for (int i = 0; i < 3; ++i) {
      publisher.say("x");
      ASSERT_TRUE(publisher.hear("published"));
    }
    ::kill(worker, SIGCONT);
    wait_until([&] {
      const auto source = daemon_.source("/Low:o");
      return is_told() || source["open"] != true || source["component"]["pid"] != worker;
    });
  }
}

// RouDi gives up a process that it has not heard of for 1.5 s, and tells it nothing.
TEST_F(Iceoryx, AWorkerThatWasHeldUpForTooLongIsReplaced) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o") + out("/Base:i", "base"));
  wait_for_description("/Low:o", "no publisher matched");
  const pid_t worker = worker_of("/Low:o");
  stop(worker);
  const auto stopped = shm::monotonic_now();
  wait_until([&] { return shm::monotonic_now() - stopped > 1'300'000'000; });
  ::kill(worker, SIGCONT);
  ASSERT_TRUE(gate.hear("the gateway was held up, so that RouDi may have given it up"));
  wait_for_another_worker("/Low:o", worker);
  expect_that_samples_pass();
}

// A publisher that keeps samples for who comes later gives them to who asks.
TEST_F(Iceoryx, WhatWasPublishedBeforeTheGatewayCameNeverArrives) {
  const Roudi roudi(directory_);
  Spoken publisher = plain_publisher("low", 0, 8);
  for (const char* text : {"one", "two"}) {
    publisher.say(text);
    ASSERT_TRUE(publisher.hear("published"));
  }
  Spoken gate = gateway(directory_, in("low", "/Low:o"));
  wait_for_description("/Low:o", "1 publisher matched");
  publisher.say("now");
  wait_for_description("/Low:o", "the last sample has 3 bytes");
  EXPECT_EQ(daemon_.source("/Low:o")["published"], 1);
  EXPECT_EQ(described("/Low:o").find("late"), std::string::npos);
}

// A gateway that was stopped for longer than T discards what has waited meanwhile. On a machine
// that is so slow that other samples are late, too, they are said again.
TEST_F(Iceoryx, WhatHasWaitedForLongerThanTNeverArrives) {
  daemon_.load(
      "<behaviors timeout='400ms'><behavior name='Low'><config at='/Base:i'>/Low:o</config>"
      "</behavior></behaviors>");
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o"));
  Spoken publisher = plain_publisher("low");
  Node node("base");
  auto base = node.input_port("/Base:i");
  std::vector<std::string> taken;
  const auto say = [&](const std::string& text) {
    publisher.say(text);
    ASSERT_TRUE(publisher.hear("published"));
  };
  const auto say_until_it_arrives = [&](const std::string& text) {
    while (taken.empty() || taken.back() != text) {
      say(text);
      while (auto sample = base.wait_for(std::chrono::milliseconds(100))) {
        taken.emplace_back(reinterpret_cast<const char*>(sample->data()), sample->size());
      }
    }
  };
  say_until_it_arrives("before");
  const pid_t worker = worker_of("/Low:o");
  stop(worker);
  const auto stopped = shm::monotonic_now();
  say("then");
  wait_until([&] { return shm::monotonic_now() - stopped > 800'000'000; });
  ::kill(worker, SIGCONT);
  say_until_it_arrives("after");
  EXPECT_THAT(taken, testing::Not(testing::Contains("then")));
}

}  // namespace
}  // namespace arbiter::test
