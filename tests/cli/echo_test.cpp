// arbiter echo: what arrives at a port that others have open, or nobody.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <filesystem>
#include <map>
#include <sstream>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/await.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/raw_publisher.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// /high overrides /low at /p. Publishes both, again and again, until the program has ended.
class Publishing {
 public:
  ProgramResult during(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), std::string(ARBITER_PROGRAMS) + "/arbiter");
    const std::string out = directory_.path() + "/out";
    const std::string err = directory_.path() + "/err";
    const shm::FileDescriptor out_file(::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600));
    const shm::FileDescriptor err_file(::open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600));
    ChildProcess program(arguments, {}, {-1, out_file.get(), err_file.get()});
    pollfd end{program.descriptor(), POLLIN, 0};
    while (::poll(&end, 1, 1) == 0) {  // slowly enough for samples to be kept
      low_.publish(std::uint32_t{0x04030201});
      high_.publish(std::uint32_t{0xffffffff});
      low_.publish(std::uint32_t{0x08070605});
      high_.deactivate();
      if (takes) static_cast<void>(in_.take());
    }
    ProgramResult result;
    result.exit_code = program.wait();
    result.out = content_of(out);
    result.err = content_of(err);
    return result;
  }

  bool takes = false;

 private:
  static std::string content_of(const std::string& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  TemporaryDirectory directory_;
  Node node_{"test"};
  InputPort<std::uint32_t> in_ = node_.input_port<std::uint32_t>("/p");
  OutputPort<std::uint32_t> low_ = node_.output_port<std::uint32_t>("/low");
  OutputPort<std::uint32_t> high_ = node_.output_port<std::uint32_t>("/high");
};

std::vector<json> objects(const std::string& text) {
  std::vector<json> all;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) all.push_back(json::parse(line));
  return all;
}

TEST(EchoOfOneByte, SaysByte) {
  Daemon daemon(kOverrideModel);
  Node node("test");
  auto low = node.output_port<std::uint8_t>("/low");
  const std::string out = daemon.directory() + "/out";
  const shm::FileDescriptor file(::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600));
  ChildProcess program({std::string(ARBITER_PROGRAMS) + "/arbiter", "echo", "/low", "--count", "1"},
                       {}, {-1, file.get(), file.get()});
  pollfd end{program.descriptor(), POLLIN, 0};
  while (::poll(&end, 1, 1) == 0) low.publish(std::uint8_t{7});
  EXPECT_EQ(program.wait(), 0);
  EXPECT_THAT(content_of(out), HasSubstr("  1 byte  "));
}

TEST(Echo, OfAnInputPortShowsWhatItAcceptsThoughAComponentHasItOpen) {
  Daemon daemon(kOverrideModel);
  Publishing publishing;
  const auto result = publishing.during({"echo", "/p", "--count", "50", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto all = objects(result.out);
  ASSERT_EQ(all.size(), 50u);
  for (const json& each : all) {
    EXPECT_EQ(each["port"], "/p");
    EXPECT_EQ(each["kind"], "sample");
    EXPECT_EQ(each["size"], 4);
    EXPECT_EQ(each["type"], type_of<std::uint32_t>().name());
    EXPECT_EQ(each["fates"], (json{{"/p", "accepted"}}));
  }
}

TEST(Echo, WithLosersShowsWhatBecameOfEach) {
  Daemon daemon(kOverrideModel);
  Publishing publishing;
  const auto result = publishing.during({"echo", "/p", "--losers", "--count", "200", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::set<std::string> met;
  for (const json& each : objects(result.out)) {
    met.insert(each["source"].get<std::string>() + " " + each["kind"].get<std::string>() + " " +
               each["fates"].value("/p", "-"));
  }
  EXPECT_THAT(met, testing::IsSupersetOf({"/low sample accepted", "/low sample discarded",
                                          "/high sample accepted", "/high deactivation -"}));
}

// The component takes one sample where two are accepted.
// Also of a name that only an earlier watcher has given.
TEST(Echo, SaysAtOnceThatNobodyHasThePortOpen) {
  Daemon daemon(kOverrideModel);
  const std::vector<std::string> watch{"echo", "/low", "--for", "1ms"};
  EXPECT_EQ(arbiter(watch).err, "arbiter: no component has /low open; waiting for one\n");
  EXPECT_EQ(arbiter({"echo", "/p", "--rate", "--for", "1ms"}).err,
            "arbiter: no component has /p open; waiting for one\n");
  Node node("test");
  auto speed = node.output_port<int>("/speed");
  auto low = node.output_port<int>("/low");
  EXPECT_EQ(arbiter(watch).err, "");
  const std::vector<std::string> misspelt{"echo", "/speeed", "--for", "1ms"};
  for (int i = 0; i < 2; ++i) {
    EXPECT_THAT(arbiter(misspelt).err, HasSubstr("; did you mean \"/speed\"?\n"));
  }
}

// A pipe that nobody reads any more: nothing arrives that could be written.
TEST(Echo, EndsWhereItsReaderHasGone) {
  Daemon daemon(kOverrideModel);
  Node node("test");
  auto in = node.input_port<int>("/p");
  for (const char* how : {"--losers", "--rate", "--json"}) {
    int ends[2];
    ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
    shm::FileDescriptor reader(ends[0]);
    const shm::FileDescriptor out(ends[1]);
    const std::string err = daemon.directory() + "/echo.err";
    const shm::FileDescriptor file(
        ::open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
    ChildProcess program({ARBITER_PROGRAMS "/arbiter", "echo", "/p", how}, {},
                         {-1, out.get(), file.get()});
    reader.reset();
    program.wait();
    EXPECT_EQ(std::filesystem::file_size(err), 0u) << how;
  }
}

TEST(Echo, WithLosersShowsWhatIsOvertaken) {
  Daemon daemon(kOverrideModel);
  Publishing publishing;
  publishing.takes = true;
  std::map<std::string, std::uint64_t> counts;
  do {  // on a busy machine too little may be published within that time
    const auto result = publishing.during({"echo", "/p", "--losers", "--for", "300ms", "--json"});
    for (const json& each : objects(result.out)) {
      counts[each["kind"].get<std::string>()] += each.value("count", std::uint64_t{0});
    }
    ASSERT_EQ(counts["sample"], 0u);
  } while (counts["overtaken"] == 0);
}

TEST(Echo, OfAnOutputPortShowsEachArrivalWithItsBytes) {
  Daemon daemon(kOverrideModel);
  Publishing publishing;
  ProgramResult result;
  do {  // on a busy machine samples may be overwritten before they are shown
    result = publishing.during({"echo", "/low", "--count", "40", "--hex"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
  } while (result.out.find("(overwritten)") != std::string::npos);
  EXPECT_THAT(result.out, AllOf(HasSubstr("  /low  #"), HasSubstr("  4 bytes  accepted at /p\n"),
                                HasSubstr("  4 bytes  discarded at /p\n"),
                                HasSubstr("    00000000  05 06 07 08\n"), Not(HasSubstr("/high")),
                                HasSubstr("40 events in ")));
}

TEST(Echo, TellsTheRate) {
  Daemon daemon(kOverrideModel);
  Publishing publishing;
  std::vector<json> all;
  do {  // on a busy machine nothing may be published within that time
    const auto result =
        publishing.during({"echo", "/p", "--losers", "--rate", "--for", "30ms", "--json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    all = objects(result.out);
    ASSERT_LE(all.size(), 2u);
  } while (all.size() < 2 || all[0]["samples"] < 3 || all[1]["samples"] < 3);
  for (const json& each : all) {
    EXPECT_GT(each["samples"], 0);
    EXPECT_GT(each["hz"], 0);
    EXPECT_TRUE(each["jitter_ns"].is_number_integer());
    EXPECT_GE(each["jitter_ns"], 0);
    EXPECT_TRUE(each["longest_ns"].is_number_integer());
    EXPECT_GT(each["longest_ns"], 0);
    const double bytes = each["bytes_per_second"];
    EXPECT_NEAR(bytes, 4 * each["hz"].get<double>(), bytes / 1000);
  }
  std::string out;
  do {
    const auto result = publishing.during({"echo", "/low", "--rate", "--for", "30ms"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    out = result.out;
  } while (out.find("/low  ") == std::string::npos);
  EXPECT_THAT(out, AllOf(HasSubstr(" Hz  jitter "), HasSubstr("B/s\n")));
}

// Of a source that is seen, of which nothing is accepted: there is no port.
TEST(Echo, TellsNoTimesOfASourceThatSendsNothing) {
  Daemon daemon(kOverrideModel);
  Node node("test");
  auto low = node.output_port<std::uint32_t>("/low");
  const std::string path = daemon.directory() + "/out";
  for (const bool is_json : {false, true}) {
    std::string text;
    while (text.empty()) {  // on a busy machine nothing may be seen within that time
      std::vector<std::string> arguments{
          ARBITER_PROGRAMS "/arbiter", "echo", "/p", "--rate", "--for", "30ms"};
      if (is_json) arguments.emplace_back("--json");
      const shm::FileDescriptor out(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600));
      ChildProcess program(arguments, {}, {-1, out.get(), -1});
      pollfd end{program.descriptor(), POLLIN, 0};
      while (::poll(&end, 1, 1) == 0) low.publish(7U);
      EXPECT_EQ(program.wait(), 0);
      text = content_of(path);
    }
    if (!is_json) {
      EXPECT_EQ(text, "/low  0.0 Hz  jitter -  longest -  0 B/s\n");
      continue;
    }
    const json line = json::parse(text);
    EXPECT_EQ(line["samples"], 0);
    EXPECT_TRUE(line["jitter_ns"].is_null());
    EXPECT_TRUE(line["longest_ns"].is_null());
  }
}

TEST(Echo, SaysWhatBecomesOfTheDaemonAndOfThePortInAnotherModel) {
  Daemon daemon(kOverrideModel);
  const std::string path = daemon.directory() + "/err";
  for (const char* way : {"--losers", "--rate", "--as-component"}) {
    const shm::FileDescriptor err(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600));
    const ChildProcess program({ARBITER_PROGRAMS "/arbiter", "echo", "/p", way}, {},
                               {-1, -1, err.get()});
    const auto said = [&](const char* text) {
      return content_of(path).find(text) != std::string::npos;
    };
    const bool is_component = way == std::string("--as-component");
    await([&] {
      return is_component ? daemon.input("/p")["open"] == true : said("no component has /p open");
    });
    daemon.load("<behaviors><arbiter at='/q'><select from='/low'/></arbiter></behaviors>");
    await([&] { return said("which is in force now, does not mention /p\n"); });
    daemon.kill();
    await([&] {
      return said(
          "the daemon has gone; its last decisions stay in force, and arbiter "
          "keeps watching them\n");
    });
    daemon.restart();
    await([&] { return said("a daemon is there again\n"); });
    daemon.load(kOverrideModel);
  }
}

TEST(Echo, AsAComponentGoesOnBesideADaemonThatHasOtherMemory) {
  Daemon daemon(kOverrideModel);
  const std::string path = daemon.directory() + "/out";
  const shm::FileDescriptor out(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600));
  const ChildProcess program({ARBITER_PROGRAMS "/arbiter", "echo", "/p", "--as-component"}, {},
                             {-1, out.get(), out.get()});
  const auto has = [&](const char* text) {
    return content_of(path).find(text) != std::string::npos;
  };
  await([&] { return daemon.input("/p")["open"] == true; });
  daemon.kill();
  daemon.lose_state();
  daemon.restart();
  await(
      [&] { return has("it came without the memory of the last one; arbiter opens /p again\n"); });
  Node node("test");
  auto low = node.output_port<int>("/low");
  await([&] {
    low.publish(1);
    return has("/low  #");
  });
}

TEST(Echo, SaysSoOfADaemonThatDidNotAnswerAtFirst) {
  Daemon daemon(kOverrideModel);
  const std::string path = daemon.directory() + "/err";
  const shm::FileDescriptor err(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600));
  daemon.process().stop();
  const ChildProcess program({ARBITER_PROGRAMS "/arbiter", "echo", "/p"}, {}, {-1, -1, err.get()});
  const auto said = [&](const char* text) {
    return content_of(path).find(text) != std::string::npos;
  };
  await([&] { return said("waiting for the arbiterd"); });
  daemon.process().resume();
  await([&] { return said("no component has /p open"); });  // it knows which model is in force
  daemon.load("<behaviors><arbiter at='/q'><select from='/low'/></arbiter></behaviors>");
  await([&] { return said("which is in force now, does not mention /p\n"); });
}

TEST(Echo, AsAComponentTakesThePort) {
  Daemon daemon(kOverrideModel);
  Node node("test");
  auto in = node.input_port("/p");
  const auto result = arbiter({"echo", "/p", "--as-component", "--for", "1ms"});
  EXPECT_NE(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("the input port /p is held by"));
  EXPECT_EQ(arbiter({"echo", "/p", "--as-component", "--rate"}).exit_code, 2);
}

TEST(Echo, AsAComponentTakesNoOutputPort) {
  Daemon daemon(kOverrideModel);
  auto result = arbiter({"echo", "/low", "--as-component", "--for", "1ms"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err,
            "arbiter: /low is an output port of the model in force; --as-component takes an input "
            "port. To watch it, leave out --as-component\n");
  Node node("walker");
  auto low = node.output_port<int>("/low");
  result = arbiter({"echo", "/low", "--as-component", "--for", "1ms"});
  EXPECT_THAT(result.err, HasSubstr("/low is an output port of walker; --as-component takes an "));
  EXPECT_EQ(arbiter({"echo", "/new", "--as-component", "--for", "1ms"}).exit_code, 0);
}

TEST(Echo, JudgesTheNameBeforeItSaysWhoHasIt) {
  Daemon daemon(kOverrideModel);
  for (const char* name : {"", "p", "/p q"}) {
    for (const char* way : {"--losers", "--rate", "--as-component"}) {
      const auto result = arbiter({"echo", name, way, "--for", "1ms"});
      EXPECT_EQ(result.exit_code, 2) << name;
      EXPECT_THAT(result.err, AllOf(HasSubstr("; echo takes one port"),
                                    Not(HasSubstr("no model and no component"))));
    }
  }
  EXPECT_THAT(arbiter({"echo", "/p*", "--for", "1ms"}).err,
              HasSubstr("no component has named /p* yet; echo takes one port, not a pattern"));
}

TEST(Echo, CountsOneEventInTheSingular) {
  Daemon daemon(kOverrideModel);
  Publishing publishing;
  EXPECT_THAT(publishing.during({"echo", "/low", "--count", "1"}).out, HasSubstr("\n1 event in "));
  EXPECT_THAT(publishing.during({"echo", "/p", "--count", "1"}).out, HasSubstr("\n1 sample in "));
}

// A publisher writes the names of its destinations into memory of its own.
TEST(Echo, PrintsNoNameThatCannotBeAPort) {
  Daemon daemon(kOverrideModel);
  RawPublisher publisher(daemon.instance(), "/low");
  std::uint64_t revision = 0;
  for (const std::string name : {"/\x1b[2J\x1b]0;owned\x07/P:i\nforged line", "/\xff"}) {
    for (const bool is_json : {false, true}) {
      std::vector<std::string> arguments{std::string(ARBITER_PROGRAMS) + "/arbiter", "echo", "/low",
                                         "--count", "1"};
      if (is_json) arguments.emplace_back("--json");
      const std::string out = daemon.directory() + "/out";
      const shm::FileDescriptor file(::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600));
      ChildProcess program(arguments, {}, {-1, file.get(), -1});
      publisher.admit();
      shm::write_destinations(publisher.events(), ++revision, {{1, name}});
      publisher.signal_at(shm::monotonic_now(), revision);
      EXPECT_EQ(program.wait(), 0);
      const std::string text = content_of(out);
      EXPECT_THAT(text, AllOf(HasSubstr("signal"), Not(HasSubstr("forged"))));
      EXPECT_EQ(text.find_first_of("\x1b\x07\xff"), std::string::npos) << text;
    }
  }
}

TEST(Echo, SaysThatThePolicyForbidsIt) {
  const TemporaryDirectory files;
  const std::string policy = files.write("policy", "deny everyone tap /p\nallow everyone all\n");
  Daemon daemon(kOverrideModel, {.arguments = {"--policy", policy}});
  const auto result = arbiter({"echo", "/p", "--for", "1ms"});
  EXPECT_NE(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("may not tap the port /p"));
}

}  // namespace
}  // namespace arbiter::test
