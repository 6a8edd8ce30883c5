// Where the daemon listens, and which directories it trusts.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include <arbiter/arbiter.hpp>

#include "tests/support/daemon.hpp"

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
