// An instance that is watched: what is seen of it, and what becomes of that where daemons go.
#include "watch/instance.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>

#include <arbiter/arbiter.hpp>

#include "tests/support/error_of.hpp"
#include "tests/watch/watched.hpp"
#include "watch/picture.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

// Two ports; /high inhibits /low at one of them.
const std::string kModel = R"(<behaviors timeout="3600s">
  <behavior name="Low"><config at="/p">/low</config><config at="/q">/low</config></behavior>
  <arbiter at="/r"><select from="/other"/></arbiter>
  <behavior name="High"><config at="/p">/high</config><inhibition>Low</inhibition></behavior>
</behaviors>
)";

// Who wins, by name; "-": nobody.
std::string winner(const watch::Instance& instance, const std::string& port) {
  const auto id = instance.find_port(port);
  if (!id) return "no such port";
  const auto picture = watch::take_picture(*instance.memory(), watch::sources_at(*id));
  EXPECT_TRUE(picture.is_settled);
  const shm::SourceId source = picture.winner_at(*id);
  return source == shm::kNone ? "-" : instance.memory()->source_name(source);
}

std::ptrdiff_t threads_of_this_process() {
  const std::filesystem::directory_iterator tasks("/proc/self/task");
  return std::distance(begin(tasks), end(tasks));
}

TEST(Instance, SeesWhoWinsAtEachPort) {
  Daemon daemon(kModel);
  Node node("component");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  const auto instance = watched(daemon);
  EXPECT_EQ(winner(*instance, "/p"), "-");
  low.publish(1);
  EXPECT_EQ(winner(*instance, "/p"), "/low");
  high.signal();
  EXPECT_EQ(winner(*instance, "/p"), "/high");
  EXPECT_EQ(winner(*instance, "/q"), "-");  // the inhibitor has no connection there, and speaks
  EXPECT_EQ(winner(*instance, "/r"), "-");
  high.deactivate();
  EXPECT_EQ(winner(*instance, "/q"), "/low");
  EXPECT_EQ(winner(*instance, "/none"), "no such port");
}

TEST(Instance, KnowsTheNamesOfPortsAndSources) {
  Daemon daemon(kModel);
  const auto instance = watched(daemon);
  std::set<std::string> names;
  for (const auto& [id, name] : instance->port_names()) names.insert(name);
  EXPECT_THAT(names, testing::ElementsAre("/p", "/q", "/r"));
  const auto source = instance->find_source("/high");
  ASSERT_TRUE(source);
  EXPECT_EQ(instance->memory()->source_name(*source), "/high");
  EXPECT_FALSE(instance->find_source("/p"));
}

// It need not look for it.
TEST(Instance, IsToldOfAnotherModel) {
  Daemon daemon(kModel);
  const auto instance = watched(daemon);
  pollfd told{instance->descriptor(), POLLIN, 0};
  EXPECT_EQ(::poll(&told, 1, 0), 0) << "nothing has changed";
  const auto before = instance->memory()->tables().generation();
  daemon.load(kModel + "<!-- reloaded -->");
  EXPECT_EQ(::poll(&told, 1, -1), 1);
  EXPECT_GT(instance->memory()->tables().generation(), before);
  instance->update();
  EXPECT_EQ(::poll(&told, 1, 0), 0) << "once is enough";
}

TEST(Instance, IsNoComponentAndStartsNoThread) {
  Daemon daemon(kModel);
  const auto before = threads_of_this_process();
  const auto instance = watched(daemon);
  EXPECT_EQ(threads_of_this_process(), before);
  const wire::Status status = instance->status();
  EXPECT_EQ(status.clients, 1u);
  for (const auto& source : status.sources) EXPECT_FALSE(source.open) << source.name;
}

TEST(Instance, HearsOfPortsThatAreNewAndOfModels) {
  Daemon daemon(kModel);
  const auto instance = watched(daemon);
  Node node("component");
  auto out = node.output_port<int>("/new");
  update_until(*instance, [&] { return instance->find_source("/new").has_value(); });
  // A watcher that takes nothing up holds up no reload.
  daemon.load("<behaviors><arbiter at='/s'><select from='/new'/></arbiter></behaviors>");
  EXPECT_EQ(instance->memory()->tables().generation(), 2u);
  update_until(*instance, [&] { return instance->find_port("/s").has_value(); });
  out.signal();
  EXPECT_EQ(winner(*instance, "/s"), "/new");
}

// A name that nobody needs is given back; who opens it again has another id.
TEST(Instance, FindsANameThatHasBeenGivenBackAndTakenAgain) {
  Daemon daemon(kModel);
  Node node("component");
  const auto instance = watched(daemon);
  std::optional<shm::PortId> port;
  std::optional<shm::SourceId> source;
  for (int i = 0; i < 3; ++i) {
    const auto in = node.input_port<int>("/again");
    const auto out = node.output_port<int>("/again:o");
    update_until(*instance, [&] {
      return instance->find_port("/again") != port && instance->find_source("/again:o") != source;
    });
    port = instance->find_port("/again");
    source = instance->find_source("/again:o");
    ASSERT_TRUE(port && source);
  }
  const auto& names = instance->port_names();
  EXPECT_EQ(std::count_if(names.begin(), names.end(),
                          [](const auto& each) { return each.second == "/again"; }),
            1);
}

TEST(Instance, SeesOnWhileTheDaemonIsStoppedOrGone) {
  Daemon daemon(kModel);
  Node node("component");
  auto low = node.output_port<int>("/low");
  const auto instance = watched(daemon);
  daemon.process().stop();
  low.signal();
  EXPECT_EQ(winner(*instance, "/p"), "/low");
  daemon.process().signal(SIGCONT);
  daemon.kill();
  update_until(*instance, [&] { return !instance->has_daemon(); });
  low.deactivate();
  EXPECT_EQ(winner(*instance, "/p"), "-");
  low.signal();
  EXPECT_EQ(winner(*instance, "/p"), "/low");
}

TEST(Instance, GoesOnWithADaemonThatTakesOver) {
  Daemon daemon(kModel);
  Node node("component");
  auto low = node.output_port<int>("/low");
  const auto instance = watched(daemon);
  const auto memory = instance->memory();
  daemon.kill();
  update_until(*instance, [&] { return !instance->has_daemon(); });
  daemon.restart();
  update_until(*instance, [&] { return instance->has_daemon(); });
  EXPECT_EQ(instance->daemons(), 2u);
  EXPECT_EQ(instance->memory(), memory);
  EXPECT_EQ(instance->status().pid, daemon.process().pid());
  auto high = node.output_port<int>("/high");
  high.signal();
  update_until(*instance, [&] { return winner(*instance, "/p") == "/high"; });
  auto later = node.output_port<int>("/later");
  update_until(*instance, [&] { return instance->find_source("/later").has_value(); });
}

TEST(Instance, TakesUpTheMemoryOfADaemonThatHasItsOwn) {
  Daemon daemon(kModel);
  const auto instance = watched(daemon);
  const auto memory = instance->memory();
  daemon.kill();
  daemon.lose_state();
  daemon.write_model("<behaviors><arbiter at='/s'><select from='/new'/></arbiter></behaviors>");
  daemon.restart();
  update_until(*instance, [&] { return instance->find_port("/s").has_value(); });
  EXPECT_NE(instance->memory(), memory);
  EXPECT_FALSE(instance->find_port("/p"));  // the last one's names are forgotten with it
  EXPECT_FALSE(instance->find_source("/low"));
}

// The question is asked again of the next one.
TEST(Instance, AsksTheDaemonThatComesWhereOneHasGone) {
  Daemon daemon(kModel);
  const auto instance = watched(daemon);
  daemon.kill();
  daemon.restart();
  EXPECT_EQ(instance->status().pid, daemon.process().pid());
}

TEST(Instance, SaysThatTheDaemonHasGoneWhereNoneComes) {
  Daemon daemon(kModel);
  wire::Caller caller = caller_of(daemon);
  caller.answer_time = std::chrono::milliseconds(100);
  const auto instance = watched_by(caller);
  daemon.kill();
  EXPECT_EQ(error_of([&] { static_cast<void>(instance->status()); }),
            "the daemon has gone, and no other has come");
}

TEST(Instance, SaysWhatThePolicyForbids) {
  const TemporaryDirectory files;
  const auto policy = files.write("policy", "deny everyone observe\n");
  Daemon daemon(kModel, {.arguments = {"--policy", policy}});
  EXPECT_THAT(error_of([&] { watched(daemon); }), HasSubstr("deny everyone observe"));
}

}  // namespace
}  // namespace arbiter::test
