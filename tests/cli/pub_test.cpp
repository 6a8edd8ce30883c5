// arbiter pub: payloads and types from the command line, and what is said if nobody can take them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>

#include <arbiter/arbiter.hpp>

#include "tests/cli/arbiter_program.hpp"
#include "tests/client/component.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {

struct PubNumber {
  std::uint64_t value;
};
struct PubPair {
  std::uint32_t first, second;
};

namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const std::string kPubModel =
    "<behaviors timeout='1000s'><arbiter at='/in'><select from='/out'>not /stop</select></arbiter>"
    "<arbiter at='/in2'><select from='/both'/></arbiter>"
    "<arbiter at='/in3'><select from='/both'/></arbiter></behaviors>";
const std::string kNumber = "arbiter::test::PubNumber:8:8";

NodeOptions quiet() {
  NodeOptions options;
  options.on_notice = [](const Notice&) {};
  return options;
}

ProgramResult pub(std::vector<std::string> arguments, std::string_view input = {}) {
  arguments.insert(arguments.begin(), {std::string(ARBITER_PROGRAMS) + "/arbiter", "pub"});
  arguments.insert(arguments.end(), {"--count", "1"});
  return run_program(arguments, input);
}

TEST(Pub, FeedsATypedPortWithATypeAndHex) {
  Daemon daemon(kPubModel);
  Node node("test");
  auto in = node.input_port<PubNumber>("/in");
  const auto result = pub({"/out", "--type", kNumber, "--hex", "0102 03\t04\n0506070a"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("published 1 sample of 8 bytes: delivered 1"));
  const auto sample = in.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ((*sample)->value, 0x0a07060504030201u);
}

TEST(Pub, SaysWhatToDoWhereTheDaemonIsStopped) {
  Daemon daemon(kPubModel);
  daemon.process().stop();
  const auto result = pub({"/out"});
  daemon.process().resume();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("waiting for the arbiterd of instance \"test\" to answer\n"));
  EXPECT_THAT(result.err, Not(HasSubstr("300 ms")));
  EXPECT_THAT(result.err, EndsWith("it is stopped; run: kill -CONT " +
                                   std::to_string(daemon.process().pid()) + "\n"));
}

TEST(Pub, TakesTheTypeOfAnInputPort) {
  Daemon daemon(kPubModel);
  Node node("test");
  auto in = node.input_port<PubNumber>("/in");
  EXPECT_EQ(pub({"/out", "--like", "/in", "--text", "12345678"}).err, "");
  {
    const auto sample = in.take();
    ASSERT_TRUE(sample);
    EXPECT_EQ((*sample)->value, 0x3837363534333231u);
  }
  // Of a source that nobody has open: what its input ports take. Without a payload: zeros.
  EXPECT_EQ(pub({"/out", "--like", "/out"}).err, "");
  const auto sample = in.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ((*sample)->value, 0u);
}

TEST(Pub, TakesTheTypeOfAnOutputPort) {
  Daemon daemon(kPubModel);
  Node node("test");
  auto in = node.input_port<PubNumber>("/in");
  auto other = node.output_port<PubNumber>("/stop");
  EXPECT_EQ(pub({"/out", "--like", "/stop"}).err, "");
  EXPECT_TRUE(in.take());
}

TEST(Pub, ReadsThePayloadFromAFileOrStandardInput) {
  Daemon daemon(kPubModel);
  Node node("test");
  auto in = node.input_port("/in");
  const TemporaryDirectory files;
  const std::string bytes("a\0b\xff\n", 5);
  const auto expect_sample = [&] {
    const auto sample = in.take();
    ASSERT_TRUE(sample);
    ASSERT_EQ(sample->size(), bytes.size());
    EXPECT_EQ(std::memcmp(sample->data(), bytes.data(), bytes.size()), 0);
  };
  EXPECT_EQ(pub({"/out", "--file", files.write("payload", bytes)}).exit_code, 0);
  expect_sample();
  EXPECT_EQ(pub({"/out", "--file", "-"}, bytes).exit_code, 0);
  expect_sample();
  EXPECT_EQ(pub({"/out", "--text", ""}).exit_code, 0);
  const auto empty = in.take();
  ASSERT_TRUE(empty);
  EXPECT_EQ(empty->size(), 0u);
}

TEST(Pub, APayloadThatDoesNotFitIsAnErrorThatSaysBothSizes) {
  Daemon daemon(kPubModel);
  Node node("test");
  auto in = node.input_port<PubNumber>("/in");
  const TemporaryDirectory files;
  const std::string what =
      "the payload has 3 bytes, but a sample of arbiter::test::PubNumber (8 bytes, aligned to 8) "
      "has 8 bytes; nothing was published\n";
  const std::vector<std::vector<std::string>> wrong = {{"--hex", "010203"},
                                                       {"--text", "abc"},
                                                       {"--size", "3"},
                                                       {"--file", files.write("payload", "abc")}};
  for (const auto& payload : wrong) {
    for (const auto& type : {std::pair{"--like", std::string("/in")}, {"--type", kNumber}}) {
      const auto result = pub({"/out", payload[0], payload[1], type.first, type.second});
      EXPECT_EQ(result.exit_code, 2);
      EXPECT_EQ(result.out, "");
      EXPECT_THAT(result.err, HasSubstr(payload[0] + ": " + what));
    }
  }
  EXPECT_FALSE(in.take());
  EXPECT_EQ(daemon.source("/out")["active"], false);
}

TEST(Pub, SaysWhatIsWrongWithTheCommandLine) {
  const auto error = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "/out");
    const auto result = pub(arguments);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_EQ(result.out, "");
    return result.err;
  };
  EXPECT_THAT(error({"--hex", "0A 0G"}), HasSubstr("character 5 is not a hexadecimal digit"));
  EXPECT_THAT(error({"--hex", "0A0"}), HasSubstr("half a byte at the end, behind 1 byte;"));
  EXPECT_THAT(error({"--file", "/nowhere/payload"}), HasSubstr("cannot open /nowhere/payload"));
  const TemporaryDirectory files;
  const auto large = files.write("large", "");
  ASSERT_EQ(::truncate(large.c_str(), off_t{1025} << 20), 0);
  EXPECT_THAT(error({"--file", large}), HasSubstr("has more than 1024 MiB"));
  for (const char* text : {"geometry/Twist", "geometry/Twist:48", ":48:8", "a::8", "a:-8:8",
                           "a:8:8:", "a:8x:8", "a:99999999999999999999:8"}) {
    EXPECT_THAT(error({"--type", text}), HasSubstr("is not of the form NAME:SIZE:ALIGN")) << text;
  }
  EXPECT_THAT(error({"--type", "a:8:3"}), HasSubstr("a power of two"));
  EXPECT_THAT(error({"--type", "a:0:8"}), HasSubstr("it has no bytes"));
  EXPECT_THAT(error({"--type", "Big:1099511627776:8"}), HasSubstr("larger than 1024 MiB"));
  EXPECT_THAT(error({"--type", "a:8:8", "--like", "/in"}), HasSubstr("excludes"));
  EXPECT_THAT(error({"--hex", "00", "--text", "a"}), HasSubstr("excludes"));
}

TEST(Pub, SaysWhyThereIsNoTypeLikeThat) {
  Daemon daemon(kPubModel);
  Node node("test");
  const auto error = [](const std::string& like) {
    const auto result = pub({"/out", "--like", like});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.out, "");
    return result.err;
  };
  EXPECT_EQ(error("/in"),
            "arbiter: --like: no component has /in open, so its type is not known; start its "
            "component, or name the type with --type NAME:SIZE:ALIGN\n");
  EXPECT_THAT(error("/out"), HasSubstr("no component has /out open, nor /in, which the model"));
  EXPECT_THAT(error("/outt"), HasSubstr("the model does not mention it; did you mean \"/out\"?"));
  auto untyped = node.input_port("/in");
  EXPECT_THAT(error("/in"), AllOf(HasSubstr("/in of \"test\" takes untyped samples; leave --like "),
                                  HasSubstr("--type NAME:SIZE:ALIGN\n")));
  EXPECT_THAT(error("/out"), HasSubstr("/in of \"test\" takes untyped samples; leave --like out"));
  auto in2 = node.input_port<PubNumber>("/in2");
  auto in3 = node.input_port<PubPair>("/in3");
  EXPECT_EQ(error("/both"),
            "arbiter: --like: the model connects /both to input ports that take different types: "
            "the input port /in2 of \"test\" takes arbiter::test::PubNumber (8 bytes, aligned to "
            "8) and the input port /in3 of \"test\" takes arbiter::test::PubPair (8 bytes, aligned "
            "to 4); choose one of them, such as --like /in3\n");
  auto in_and_out = node.input_port<PubNumber>("/same");
  auto out_and_in = node.output_port<PubPair>("/same");
  EXPECT_THAT(error("/same"), HasSubstr("two ports have that name: the input port /same of"));
}

// What it advises can be pasted into a shell, and works.
TEST(Pub, AdvisesTheCommandLineThatWorks) {
  Daemon daemon(kPubModel);
  Node node("test", quiet());
  auto in = node.input_port<PubNumber>("/in");
  const auto refused = pub({"/out", "--text", "it's 8 b", "--quiet"});
  EXPECT_EQ(refused.exit_code, 0);
  const std::string advice =
      "to send what /in takes, run: arbiter pub /out --like /in --text 'it'\\''s 8 b' --quiet "
      "--count 1\n";
  EXPECT_THAT(refused.err, AllOf(HasSubstr("the output port of \"arbiter-pub\" sends untyped "),
                                 EndsWith(advice)));
  const std::string command = advice.substr(advice.find("arbiter pub"));
  const auto advised =
      run_program({"/bin/sh", "-c", std::string(ARBITER_PROGRAMS) + "/" + command});
  EXPECT_EQ(advised.err, "");
  EXPECT_TRUE(in.take());
  EXPECT_THAT(pub({"/out", "--type", "Other:8:8", "--hex", "0001020304050607"}).err,
              AllOf(HasSubstr("sends Other (8 bytes, aligned to 8)"),
                    EndsWith("arbiter pub /out --like /in --hex 0001020304050607 --count 1\n")));
  EXPECT_THAT(pub({"--text", "too short", "/out"}).err,
              EndsWith("arbiter pub /out --like /in --count 1  (samples of 8 bytes: add them by "
                       "--hex, --file or --text, or they are zeros)\n"));
}

TEST(Pub, AdvisesNothingToWhoChoseATypeThatSomebodyTakes) {
  Daemon daemon(kPubModel);
  Node node("test", quiet());
  auto in2 = node.input_port<PubNumber>("/in2");
  auto in3 = node.input_port<PubPair>("/in3");
  const auto typed = pub({"/both", "--like", "/in3"});
  EXPECT_THAT(typed.err, AllOf(HasSubstr("is not connected to /in2"), Not(HasSubstr("run:"))));
  EXPECT_THAT(typed.out, HasSubstr("delivered 1"));
  const auto untyped = pub({"/both"});
  EXPECT_THAT(untyped.err, AllOf(HasSubstr("run: arbiter pub /both --like /in2 --count 1"),
                                 HasSubstr("run: arbiter pub /both --like /in3 --count 1")));
}

// A daemon that takes over does not know the type of a port before its component is back.
TEST(Pub, SaysThatAComponentHasNotComeBackYet) {
  Daemon daemon(kPubModel);
  Node keeper("keeper", quiet());  // of what the last daemon leaves
  auto kept = keeper.output_port<PubNumber>("/stop");
  Component component("stopped");
  ASSERT_EQ(component.tell("input /in"), "open");
  component.process().stop();
  daemon.kill();
  daemon.restart();
  const auto like = pub({"/out", "--like", "/in"});
  EXPECT_EQ(like.exit_code, 1);
  EXPECT_THAT(like.err,
              HasSubstr("has /in open (process " + std::to_string(component.process().pid()) +
                        ") has not come back to this daemon yet; try again, or name"));
  const auto strict = pub({"/out", "--strict"});
  EXPECT_EQ(strict.exit_code, 1);
  EXPECT_THAT(strict.err, HasSubstr("arbiter: nothing is delivered at /in before its component "
                                    "comes back to this daemon\n"));
  component.process().resume();
}

TEST(Pub, StrictPublishesNothingThatNobodyCanTake) {
  Daemon daemon(kPubModel);
  const auto strict = [&](const std::string& port) {
    const auto result = pub({port, "--strict"});
    const auto source = daemon.source(port);
    EXPECT_EQ(!source.is_null() && source["active"], result.exit_code == 0);
    return result;
  };
  Node node("test", quiet());
  for (const std::string port : {"/out", "/unmentioned"}) {
    const auto result = strict(port);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(result.err, EndsWith("arbiter: nobody can take what " + port +
                                     " sends, so nothing was published (--strict)\n"));
  }
  {
    auto in = node.input_port<PubNumber>("/in");
    EXPECT_EQ(strict("/out").exit_code, 1);
  }
  EXPECT_EQ(strict("/stop").exit_code, 0);  // is only read
  auto in = node.input_port("/in");
  EXPECT_EQ(strict("/out").exit_code, 0);
}

}  // namespace
}  // namespace arbiter::test
