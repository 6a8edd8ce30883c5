// What the recorder watches beside taps: sources that come and go, what it may ask, who is away.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "recorder/open_ports.hpp"
#include "recorder/statement_watch.hpp"
#include "rules/model/statement.hpp"
#include "tests/recorder/recording.hpp"
#include "tests/support/await.hpp"

namespace arbiter::test {
namespace {

using evidence::Arrival;
using evidence::PortChange;
using testing::HasSubstr;

const std::string kAll = "allow everyone all\n";
const std::string kNotObserve = "deny everyone observe\nallow everyone all\n";

std::size_t count_of(const std::string& part, const std::string& text) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

// Each tap takes descriptors, also of the daemon: names that come and go would take them all.
TEST(Record, TapsASourceNoMoreThatIsForgotten) {
  Daemon daemon(R"(<behaviors timeout="1ms">
    <behavior name="Low"><config at="/p">/low</config></behavior>
  </behaviors>)");
  Recording recording(daemon);
  Node node("test");
  const std::size_t before = daemon.open_descriptors();
  constexpr std::size_t kSources = 20;
  {
    std::vector<OutputPort<int>> ports;
    for (std::size_t i = 0; i < kSources; ++i) {
      ports.push_back(node.output_port<int>("/passing/" + std::to_string(i)));
    }
    const auto is_tapped = [](const nlohmann::json& source) {
      return !source.value("taps", nlohmann::json::array()).empty();
    };
    await([&] {
      const auto sources = daemon.status()["sources"];
      return std::count_if(sources.begin(), sources.end(), is_tapped) == kSources;
    });
  }
  await([&] { return daemon.open_descriptors() <= before; });
  // Under a name that was there before.
  auto again = node.output_port<int>("/passing/7");
  while (recording.records<Arrival>().empty()) again.publish(1);
  EXPECT_EQ(recording.end(), 0) << recording.error();
  for (const Arrival& each : recording.records<Arrival>()) {
    EXPECT_EQ(each.context->source, "/passing/7");
  }
}

TEST(Record, SaysOnceThatItMayNotObserveAnyMore) {
  const TemporaryDirectory files;
  const std::string policy = files.write("policy", kAll);
  Daemon daemon(kLasting, {.arguments = {"--policy", policy}});
  Recording recording(daemon);
  files.write("policy", kNotObserve);
  daemon.hang_up();
  const std::string lost = "the daemon refuses to tell; it is tried again: user ";
  recording.see(lost);
  await([&] { return count_of("may not observe", daemon.log()) >= 2; });  // it is
  files.write("policy", kAll);
  daemon.hang_up();
  recording.see("the daemon tells again");
  Node node("test");
  auto come = node.output_port<int>("/come");
  while (recording.records<Arrival>().empty()) come.publish(1);
  EXPECT_EQ(recording.end(), 0) << recording.error();
  EXPECT_EQ(count_of(lost, recording.error()), 1u) << recording.error();
  EXPECT_EQ(recording.records<evidence::ModelChange>().back().generation, 3u);
}

// It would ask five hundred times a second.
TEST(Statement, IsLookedAtOnceUnderAModelThatGivesItNoMeaning) {
  const TemporaryDirectory files;
  const std::string policy = files.write("policy", kAll);
  Daemon daemon(kLasting, {.arguments = {"--policy", policy}});
  wire::Caller caller;
  caller.name = "test";
  caller.instance = daemon.instance();
  std::mutex mutex;
  std::vector<std::string> said;
  rules::Diagnostics diagnostics;
  auto statements = rules::read_statements(rules::TextFile("--when", "/nobody"), diagnostics);
  ASSERT_EQ(statements.size(), 1u);
  recorder::StatementWatch watch(
      caller, std::move(statements.front()), [] {},
      [&](const std::string& text) {
        const std::lock_guard lock(mutex);
        said.push_back(text);
      });
  await([&] {
    const std::lock_guard lock(mutex);
    return !said.empty();
  });
  files.write("policy", kNotObserve);
  constexpr std::size_t kReloads = 4;
  for (std::size_t asked = 1; asked <= kReloads; ++asked) {
    daemon.hang_up();
    const std::string in_force = "model " + std::to_string(asked + 1) + " is in force";
    await([&] { return count_of(in_force, daemon.log()) == 1; });
    await([&] { return count_of("may not observe", daemon.log()) >= asked; });
  }
  EXPECT_EQ(count_of("may not observe", daemon.log()), kReloads) << daemon.log();
}

// While the components come back to a daemon that has taken over, one may be stopped.
TEST(OpenPorts, AreAsTheyWereWhileTheirComponentIsAway) {
  wire::Status status;
  status.inputs.resize(1);
  wire::InputStatus& input = status.inputs[0];
  input.name = "/p";
  input.open.emplace();
  input.open->component.node = "motor";
  input.open->component.pid = 12;
  recorder::OpenPorts ports(0);
  recorder::Batch batch;
  ports.note(status, 1, batch);
  ASSERT_EQ(batch.records.size(), 1u);
  const auto open = std::exchange(input.open, std::nullopt);
  input.away_pid = 12;
  ports.note(status, 2, batch);
  EXPECT_EQ(batch.records.size(), 1u) << "it is kept for it";
  input.open = open;
  input.away_pid.reset();
  ports.note(status, 3, batch);
  EXPECT_EQ(batch.records.size(), 1u);
  input.open.reset();
  input.away_pid = 13;
  ports.note(status, 4, batch);
  ASSERT_EQ(batch.records.size(), 2u) << "it is kept for another one";
  EXPECT_EQ(std::get<PortChange>(*batch.records[1]).what, PortChange::What::closed);
}

class FewDescriptors : public testing::Test {
 protected:
  static constexpr std::size_t kSources = 60;

  static std::string model() {
    std::string text = "<behaviors timeout=\"1000s\">\n<arbiter at=\"/p\" conflict=\"first\">\n";
    for (std::size_t i = 0; i < kSources; ++i) {
      text += "<select from=\"/s" + std::to_string(i) + "\"/>\n";
    }
    return text + "</arbiter>\n</behaviors>\n";
  }
  // A flight recorder under that limit: an option of `ulimit`, and a number.
  ChildProcess fly(const std::string& limit) {
    const shm::FileDescriptor file(
        ::open(err().c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
    const std::string command = "ulimit " + limit + "; exec " + ARBITER_PROGRAMS +
                                "/arbiter record --ring 5min -o " + prefix();
    ChildProcess process({"/bin/bash", "-c", command}, {}, {-1, -1, file.get()});
    pollfd ended{process.descriptor(), POLLIN, 0};
    while (content_of(err()).find("keeping the last") == std::string::npos) {
      if (::poll(&ended, 1, 1) == 1) throw std::runtime_error("it has ended: " + content_of(err()));
    }
    return process;
  }
  [[nodiscard]] std::string err() const { return daemon_.directory() + "/flight.err"; }
  [[nodiscard]] std::string prefix() const { return daemon_.directory() + "/flight"; }

  Daemon daemon_{model()};
};

// Then there is one for the file that it is there for.
TEST_F(FewDescriptors, LeaveTheRecorderOnesForItsFiles) {
  ChildProcess recorder = fly("-n 128");
  EXPECT_THAT(content_of(err()), HasSubstr("no descriptors are left for more taps"));
  const auto dumped = arbiter({"record", "--dump", "-o", prefix()});
  EXPECT_EQ(dumped.exit_code, 0) << dumped.out << dumped.err;
  EXPECT_THAT(dumped.out, testing::StartsWith("written "));
  recorder.signal(SIGINT);
  EXPECT_EQ(recorder.wait(), 0);
}

// A shell's limit is not all that it may have.
TEST_F(FewDescriptors, AreNotWhatTheRecorderIsContentWith) {
  ChildProcess recorder = fly("-S -n 128");
  EXPECT_THAT(content_of(err()), HasSubstr(" of 60 sources"));
  recorder.signal(SIGINT);
  EXPECT_EQ(recorder.wait(), 0);
}

}  // namespace
}  // namespace arbiter::test
