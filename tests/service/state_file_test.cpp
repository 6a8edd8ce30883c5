// What the next daemon needs to take over cannot be written down, or not be looked at: that keeps
// nobody from being served.
#include "service/kept/state_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"

namespace arbiter::test {
namespace {

using service::Process;
using service::Realm;
using service::StateFile;
using testing::HasSubstr;

const Realm kRealm{{1, 2}, {3, 4}};
const Realm kAnotherRealm{{1, 5}, {3, 6}};

// While it lives, this process's files grow to that many bytes.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  sighandler_t handler_ = SIG_DFL;
};

class AStateFile : public testing::Test {
 protected:
  [[nodiscard]] std::string text() const {
    std::ifstream file(path_);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  const TemporaryDirectory directory_;
  const std::string path_ = directory_.file("test.state");
  StateFile file_{directory_.path(), "test"};
};

TEST_F(AStateFile, ThatCannotBeReplacedStaysAsItIs) {
  file_.write(kRealm, {{10, 20}});
  const std::string before = text();
  {
    const FullDisk disk(before.size());
    EXPECT_THAT(error_of([&] {
                  file_.write(kRealm, {{10, 20}, {30, 40}});
                }),
                HasSubstr("test.state.new: File too large"));
  }
  EXPECT_EQ(text(), before);
  EXPECT_FALSE(std::filesystem::exists(path_ + ".new"));
  EXPECT_TRUE(file_.is_there());
}

// The next daemon would expect what nobody has, and refuse what components have.
TEST_F(AStateFile, OfAnotherRealmThatCannotBeReplacedIsGone) {
  file_.write(kAnotherRealm, {{10, 20}});
  StateFile ours(directory_.path(), "test");
  ASSERT_TRUE(ours.read());
  {
    const FullDisk disk(4);
    EXPECT_THROW(ours.write(kRealm, {}), std::system_error);
  }
  EXPECT_FALSE(std::filesystem::exists(path_));
  EXPECT_FALSE(std::filesystem::exists(path_ + ".new"));
  EXPECT_FALSE(ours.is_there());
  ours.write(kRealm, {});
  ASSERT_TRUE(ours.read());
  EXPECT_EQ(ours.read()->realm, kRealm);
}

// Or nobody could read the lines that follow.
TEST_F(AStateFile, HasNoPartOfALine) {
  file_.write(kRealm, {});
  const std::string before = text();
  {
    const FullDisk disk(before.size() + 10);
    EXPECT_THROW(file_.add({10, 20}), std::system_error);
  }
  EXPECT_EQ(text(), before);
  file_.add({30, 40});
  EXPECT_EQ(text(), before + "component 30 40\n");
}

std::string state_path(const Daemon& daemon) {
  const std::string socket = daemon.socket_path();
  return socket.substr(0, socket.rfind(".sock")) + ".state";
}

// In the place of the file that takes the state file's place: it cannot be opened.
class InTheWay {
 public:
  explicit InTheWay(const Daemon& daemon) : path_(state_path(daemon) + ".new") {
    std::filesystem::create_directory(path_);
  }
  void leave() const { std::filesystem::remove(path_); }

 private:
  std::string path_;
};

void await_in_log(const Daemon& daemon, const std::string& text) {
  await([&] { return daemon.log().find(text) != std::string::npos; });
}

TEST(StateFile, ThatCannotBeWrittenKeepsNoSuccessorFromTakingOver) {
  Daemon daemon(single_model());
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /out"), "open");
  daemon.kill();
  const InTheWay in_the_way(daemon);
  daemon.restart();
  await([&] { return daemon.source("/out")["open"] == true; });
  EXPECT_THAT(daemon.log(), HasSubstr("components that have come since must be restarted"));
  daemon.kill();
  daemon.restart();
  await([&] { return daemon.source("/out")["open"] == true; });
  in_the_way.leave();
  await_in_log(daemon, "is written down again");
}

TEST(StateFile, OfAnotherRealmThatCannotBeWrittenIsWrittenLater) {
  Daemon daemon(single_model());
  Component("gone").tell("output /out");
  daemon.kill();
  const InTheWay in_the_way(daemon);
  daemon.restart();
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /out"), "open");
  EXPECT_THAT(daemon.log(), HasSubstr("all components must be restarted"));
  EXPECT_FALSE(std::filesystem::exists(state_path(daemon)));
  in_the_way.leave();
  await_in_log(daemon, "is written down again");
  daemon.kill();
  daemon.restart();
  await([&] { return daemon.source("/out")["open"] == true; });
}

// It grows until it is written anew.
TEST(StateFile, ThatCannotBeWrittenRefusesNobody) {
  Daemon daemon(single_model());
  const InTheWay in_the_way(daemon);
  for (int i = 0; i < 80; ++i) {
    Node node("node");
    ASSERT_NO_THROW(static_cast<void>(node.input_port<Number>("/in"))) << i;
  }
  EXPECT_THAT(daemon.log(), HasSubstr("writing " + state_path(daemon) + ".new"));
  in_the_way.leave();
  await_in_log(daemon, "is written down again");
}

// Its own pages were given to others: a descriptor that is missing said that it had ended.
TEST(StateFile, WhoCannotBeWatchedForWantOfDescriptorsIsNotTakenForDead) {
  constexpr int kStopped = 40;
  constexpr int kDie = 36;
  const TemporaryDirectory files;
  const std::string limit = files.write("limit", "1024");
  Daemon::Options options;
  options.by = {"/bin/sh", "-c", "ulimit -n $(cat " + limit + R"() && exec "$0" "$@")"};
  Daemon daemon(fan_out_model(kStopped), options);
  // A fourth is kept for what messages bring.
  files.write("limit", std::to_string((daemon.open_descriptors() + 24) * 4 / 3));
  const auto port = [](int i) { return "/in" + std::to_string(i); };
  std::vector<std::unique_ptr<Component>> stopped;
  for (int i = 0; i < kStopped; ++i) {
    stopped.push_back(std::make_unique<Component>("stopped"));
    ASSERT_EQ(stopped.back()->tell("input " + port(i) + " 1 1 0"), "open");
  }
  Component back("back");  // hands back the memory, and nothing else
  ASSERT_EQ(back.tell("output /out"), "open");
  for (const auto& each : stopped) each->process().signal(SIGSTOP);
  daemon.kill();
  ASSERT_EQ(back.tell("close /out"), "closed");
  daemon.restart();
  await_in_log(daemon, "taking over");
  for (int i = 0; i < kDie; ++i) stopped[static_cast<std::size_t>(i)]->kill();
  // Where no descriptor is left nobody who comes is served.
  const auto await_served = [](const std::function<bool()>& holds) {
    await([&] {
      try {
        return holds();
      } catch (const std::exception&) {
        return false;
      }
    });
  };
  std::optional<Node> node;
  await_served([&] { return node.emplace("asking"), true; });
  await_served([&] { return static_cast<void>(node->input_port<Number>(port(kDie - 1))), true; });
  Component& living = *stopped.back();
  ASSERT_THAT(error_of([&] { static_cast<void>(node->input_port<Number>(port(kStopped - 1))); }),
              HasSubstr("which lives but does not answer"));
  living.process().signal(SIGCONT);
  await_served([&] { return daemon.input(port(kStopped - 1))["open"] == true; });
}

}  // namespace
}  // namespace arbiter::test
