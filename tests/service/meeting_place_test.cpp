// Where the daemon listens, and which directories it trusts.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/support/daemon.hpp"
#include "tests/support/text_files.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::test {
namespace {

namespace fs = std::filesystem;

// Runs a daemon in an environment, and calls `meanwhile` when it is ready. Its exit code; -1 if it
// did not become ready.
template <class Meanwhile>
int run_in(const TemporaryDirectory& directory, const Environment& environment,
           Meanwhile meanwhile) {
  NotifySocket notify(directory.path() + "/notify");
  Environment all = environment;
  all["NOTIFY_SOCKET"] = notify.path();
  ChildProcess daemon({arbiterd_path(), "--instance", "place", "--log-level", "error"}, all, {});
  if (!notify.wait_for("READY=1", daemon)) {
    EXPECT_EQ(daemon.wait(), 1);
    fs::remove(notify.path());
    return -1;
  }
  meanwhile();
  daemon.signal(SIGTERM);
  fs::remove(notify.path());
  return daemon.wait();
}

TEST(MeetingPlace, IsTheRuntimeDirectoryThatTheServiceManagerGives) {
  const TemporaryDirectory directory;
  fs::create_directory(directory.path() + "/given");
  const Environment environment{
      {"RUNTIME_DIRECTORY", directory.path() + "/given:" + directory.path() + "/second"},
      {"XDG_RUNTIME_DIR", directory.path() + "/session"}};
  const auto look = [&] { EXPECT_TRUE(fs::exists(directory.path() + "/given/place.sock")); };
  EXPECT_EQ(run_in(directory, environment, look), 0);
}

TEST(MeetingPlace, IsElseOneInTheSessionsRuntimeDirectory) {
  const TemporaryDirectory directory;
  const Environment environment{{"RUNTIME_DIRECTORY", std::nullopt},
                                {"XDG_RUNTIME_DIR", directory.path()}};
  const auto meet = [&] {
    EXPECT_TRUE(fs::exists(directory.path() + "/arbiter/place.sock"));
    const ScopedVariable session("XDG_RUNTIME_DIR", directory.path());
    Node node("test", {.instance = "place"});
  };
  EXPECT_EQ(run_in(directory, environment, meet), 0);
}

TEST(MeetingPlace, EveryUserMayConnectAndOnlyItsOwnerMayWriteThere) {
  const TemporaryDirectory directory;
  const Environment environment{{"RUNTIME_DIRECTORY", std::nullopt},
                                {"XDG_RUNTIME_DIR", directory.path()}};
  const auto look = [&] {
    struct stat status {};
    ASSERT_EQ(::stat((directory.path() + "/arbiter/place.sock").c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0666u);
    ASSERT_EQ(::stat((directory.path() + "/arbiter").c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0022, 0u);
  };
  EXPECT_EQ(run_in(directory, environment, look), 0);
}

// The next daemon believes what stands in the file beside the socket.
TEST(MeetingPlace, HasNothingThatOthersMayWriteWhateverTheUmask) {
  const TemporaryDirectory directory;
  const Environment environment{{"RUNTIME_DIRECTORY", std::nullopt},
                                {"XDG_RUNTIME_DIR", directory.path()}};
  const mode_t before = ::umask(0);
  const auto look = [&] {
    ::umask(before);
    for (const auto& entry : fs::directory_iterator(directory.path() + "/arbiter")) {
      struct stat status {};
      ASSERT_EQ(::stat(entry.path().c_str(), &status), 0);
      if (S_ISSOCK(status.st_mode)) continue;
      EXPECT_EQ(status.st_mode & 0022, 0u) << entry.path();
    }
  };
  EXPECT_EQ(run_in(directory, environment, look), 0);
  ::umask(before);
}

TEST(MeetingPlace, ThatOthersMayWriteToIsRefused) {
  const TemporaryDirectory directory;
  const std::string place = directory.path() + "/arbiter";
  fs::create_directory(place);
  ASSERT_EQ(::chmod(place.c_str(), 0777), 0);
  const Environment environment{{"RUNTIME_DIRECTORY", std::nullopt},
                                {"XDG_RUNTIME_DIR", directory.path()}};
  EXPECT_EQ(run_in(directory, environment, [] {}), -1);
}

TEST(MeetingPlace, ThatIsALinkToSomewhereElseIsRefused) {
  const TemporaryDirectory directory;
  fs::create_directory(directory.path() + "/elsewhere");
  fs::create_directory_symlink(directory.path() + "/elsewhere", directory.path() + "/arbiter");
  const Environment environment{{"RUNTIME_DIRECTORY", std::nullopt},
                                {"XDG_RUNTIME_DIR", directory.path()}};
  EXPECT_EQ(run_in(directory, environment, [] {}), -1);
}

TEST(MeetingPlace, OfAnotherUserIsRefused) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give a directory away";
  const TemporaryDirectory directory;
  const std::string place = directory.path() + "/arbiter";
  fs::create_directory(place);
  ASSERT_EQ(::chown(place.c_str(), 65534, 65534), 0);
  const Environment environment{{"RUNTIME_DIRECTORY", std::nullopt},
                                {"XDG_RUNTIME_DIR", directory.path()}};
  EXPECT_EQ(run_in(directory, environment, [] {}), -1);
}

// Each daemon and each component says that there are two, or an emergency stop would be published
// at one, and the robot driven at the other.
TEST(MeetingPlace, OfASecondDaemonOfTheInstanceIsTold) {
  const TemporaryDirectory first, second;
  const auto in = [](const TemporaryDirectory& directory) {
    return Environment{{"RUNTIME_DIRECTORY", std::nullopt}, {"XDG_RUNTIME_DIR", directory.path()}};
  };
  const auto meet_both = [&] {
    const ScopedVariable given("RUNTIME_DIRECTORY", first.path() + "/arbiter");
    const ScopedVariable session("XDG_RUNTIME_DIR", second.path());
    std::vector<Notice> notices;
    NodeOptions options;
    options.instance = "place";
    options.on_notice = [&](const Notice& notice) { notices.push_back(notice); };
    const Node node("test", options);
    ASSERT_EQ(notices.size(), 1u);
    EXPECT_EQ(notices[0].kind, NoticeKind::apart);
    EXPECT_NE(notices[0].text.find(first.path()), std::string::npos) << notices[0].text;
    EXPECT_NE(notices[0].text.find(second.path()), std::string::npos) << notices[0].text;
    EXPECT_EQ(wire::other_daemons("place", first.path() + "/arbiter"),
              std::vector<std::string>{second.path() + "/arbiter/place.sock"});
  };
  const auto start_another = [&] { EXPECT_EQ(run_in(second, in(second), meet_both), 0); };
  EXPECT_EQ(run_in(first, in(first), start_another), 0);
}

TEST(MeetingPlace, OfASecondDaemonIsInItsLog) {
  const Daemon first;
  const TemporaryDirectory directory;
  NotifySocket notify(directory.path() + "/notify");
  const std::string log = directory.write("log", "");
  const shm::FileDescriptor out(::open(log.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC));
  ChildProcess second(
      {arbiterd_path(), "--instance", first.instance()},
      {{"RUNTIME_DIRECTORY", directory.path() + "/given"}, {"NOTIFY_SOCKET", notify.path()}},
      {-1, -1, out.get()});
  ASSERT_TRUE(notify.wait_for("READY=1", second));
  second.signal(SIGTERM);
  EXPECT_EQ(second.wait(), 0);
  EXPECT_NE(content_of(log).find("another daemon of instance \"" + first.instance() +
                                 "\" listens at " + first.socket_path()),
            std::string::npos)
      << content_of(log);
}

// One directory by two names, and no daemon at all, are no second daemon.
TEST(MeetingPlace, ByTwoNamesIsOne) {
  const TemporaryDirectory directory;
  const auto meet = [&] {
    const ScopedVariable given("RUNTIME_DIRECTORY", directory.path() + "//arbiter");
    const ScopedVariable session("XDG_RUNTIME_DIR", directory.path());
    NodeOptions options;
    options.instance = "place";
    options.on_notice = [&](const Notice& notice) { ADD_FAILURE() << notice.text; };
    const Node node("test", options);
  };
  EXPECT_EQ(
      run_in(directory,
             {{"RUNTIME_DIRECTORY", std::nullopt}, {"XDG_RUNTIME_DIR", directory.path()}}, meet),
      0);
}

TEST(MeetingPlace, MayHaveALongPath) {
  const TemporaryDirectory directory;
  std::string deep = directory.path();
  for (int i = 0; i < 4; ++i) deep += "/" + std::string(60, 'd');
  fs::create_directories(deep);
  const Environment environment{{"RUNTIME_DIRECTORY", std::nullopt}, {"XDG_RUNTIME_DIR", deep}};
  const auto meet = [&] {
    const ScopedVariable session("XDG_RUNTIME_DIR", deep);
    Node node("test", {.instance = "place"});
  };
  EXPECT_EQ(run_in(directory, environment, meet), 0);
}

}  // namespace
}  // namespace arbiter::test
