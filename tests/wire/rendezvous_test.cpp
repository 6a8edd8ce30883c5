#include "wire/rendezvous.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pwd.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/other_user.hpp"
#include "tests/support/temporary_directory.hpp"

namespace {

int asked_for_arbiter = 0;
int next_lock_fails_with = 0;  // an error's number; 0: it does not

}  // namespace

// In the place of the C library's, for this program: a name service may ask a network that is not
// there.
extern "C" int getpwnam_r(const char*, passwd*, char*, size_t, passwd** found) {
  ++asked_for_arbiter;
  *found = nullptr;
  return ENOENT;
}

// Likewise: a signal, or a file system that has no locks to give.
extern "C" int flock(int file, int operation) {
  if (next_lock_fails_with == 0) {
    return static_cast<int>(syscall(SYS_flock, file, operation));
  }
  errno = std::exchange(next_lock_fails_with, 0);
  return -1;
}

namespace arbiter::wire {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// A directory and an environment of its own for each test; both are as before afterwards.
class Rendezvous : public testing::Test {
 protected:
  Rendezvous() {
    for (const char* name :
         {"RUNTIME_DIRECTORY", "XDG_RUNTIME_DIR", "TMPDIR", "ARBITER_INSTANCE"}) {
      const char* value = std::getenv(name);
      before_[name] = value == nullptr ? std::string() : value;
      unsetenv(name);
    }
    setenv("TMPDIR", directory_.c_str(), 1);
  }
  ~Rendezvous() override {
    for (const auto& [name, value] : before_) {
      value.empty() ? unsetenv(name.c_str()) : setenv(name.c_str(), value.c_str(), 1);
    }
  }

  std::string make(const std::string& name, mode_t mode = 0755) const {
    const std::string path = directory_ + "/" + name;
    EXPECT_EQ(mkdir(path.c_str(), 0700), 0);
    EXPECT_EQ(chmod(path.c_str(), mode), 0);
    return path;
  }
  template <class Attempt>
  static std::string refusal(Attempt attempt) {
    try {
      attempt();
    } catch (const std::exception& error) {
      return error.what();
    }
    return "not refused";
  }

  const test::TemporaryDirectory folder_;
  const std::string directory_ = folder_.path();

 private:
  std::map<std::string, std::string> before_;
};

TEST_F(Rendezvous, AnInstanceIsNamedByTheArgumentThenTheEnvironmentThenByDefault) {
  EXPECT_EQ(instance_name(""), "default");
  setenv("ARBITER_INSTANCE", "lab", 1);
  EXPECT_EQ(instance_name(""), "lab");
  EXPECT_EQ(instance_name("arm-2.b_C"), "arm-2.b_C");
}

TEST_F(Rendezvous, ANameThatIsNoPlainFileNameIsRefused) {
  for (const std::string name : {".", "..", ".hidden", "a/b", "../x", "a b", "a\n", "ä"}) {
    EXPECT_THROW(instance_name(name), std::invalid_argument) << name;
  }
  EXPECT_EQ(instance_name(std::string(64, 'x')).size(), 64u);
  EXPECT_THROW(instance_name(std::string(65, 'x')), std::invalid_argument);
  EXPECT_THROW(instance_name(std::string("a\0b", 3)), std::invalid_argument);
  setenv("ARBITER_INSTANCE", "../escape", 1);
  EXPECT_THROW(instance_name(""), std::invalid_argument);
}

TEST_F(Rendezvous, TheServiceManagersDirectoryGoesBeforeTheSessions) {
  const std::string given = make("given"), session = make("session");
  setenv("XDG_RUNTIME_DIR", session.c_str(), 1);
  EXPECT_EQ(daemon_directory(), session + "/arbiter");
  setenv("RUNTIME_DIRECTORY", (given + ":" + session).c_str(), 1);
  EXPECT_EQ(daemon_directory(), given);
}

TEST_F(Rendezvous, TheSessionsDirectoryIsPassedOverWhereItIsAnotherUsers) {
  if (!test::may_be_another_user()) GTEST_SKIP() << "only root can become another user";
  ASSERT_EQ(chmod(directory_.c_str(), 01777), 0);
  setenv("XDG_RUNTIME_DIR", make("session").c_str(), 1);
  EXPECT_EQ(test::as_user(test::kNobody, daemon_directory), directory_ + "/arbiter-65534");
}

TEST_F(Rendezvous, AClientLooksInEachPlaceWhereADaemonMayBeInOrder) {
  setenv("XDG_RUNTIME_DIR", "/session", 1);
  setenv("RUNTIME_DIRECTORY", "/given:/other", 1);
  const auto directories = client_directories();
  ASSERT_GE(directories.size(), 4u);
  EXPECT_EQ(directories[0], "/given");
  EXPECT_EQ(directories[1], "/session/arbiter");
  EXPECT_EQ(directories[2], "/run/arbiter");
  EXPECT_EQ(directories[3], directory_ + "/arbiter-" + std::to_string(geteuid()));
}

// Nobody's start waits for a name service where a daemon is found without.
TEST_F(Rendezvous, WhoTheUserArbiterIsIsNotAskedWhereADaemonListens) {
  const std::string session = make("session");
  setenv("XDG_RUNTIME_DIR", session.c_str(), 1);
  const Listener listener = listen_at(daemon_directory(), "one");
  asked_for_arbiter = 0;
  std::string why_not, directory;
  EXPECT_TRUE(connect_to_daemon("one", why_not, &directory)) << why_not;
  EXPECT_EQ(directory, session + "/arbiter");
  EXPECT_EQ(other_daemons("one", directory), std::vector<std::string>());
  EXPECT_EQ(asked_for_arbiter, 0);
}

// Anybody may make /tmp/arbiter-0.
TEST_F(Rendezvous, WhoTheUserArbiterIsIsNotAskedForTheSakeOfAStrangersDirectory) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can give a directory away";
  const std::string session = make("session");
  setenv("XDG_RUNTIME_DIR", session.c_str(), 1);
  const Listener listener = listen_at(daemon_directory(), "one");
  const std::string planted = make("arbiter-0");
  const Listener another = listen_at(planted, "one");
  ASSERT_EQ(chown(planted.c_str(), 65534, 65534), 0);
  asked_for_arbiter = 0;
  EXPECT_EQ(other_daemons("one", session + "/arbiter"), std::vector<std::string>());
  EXPECT_EQ(asked_for_arbiter, 0);
}

TEST_F(Rendezvous, ADirectoryThatOthersMayWriteInIsRefused) {
  for (const mode_t mode : {0775u, 0757u, 0777u, 01777u}) {
    const std::string unsafe = make("unsafe" + std::to_string(mode), mode);
    setenv("RUNTIME_DIRECTORY", unsafe.c_str(), 1);
    EXPECT_THAT(refusal([] { daemon_directory(); }), HasSubstr("others may write in " + unsafe));
  }
}

TEST_F(Rendezvous, ALinkToADirectoryOrAFileInItsPlaceIsRefused) {
  const std::string target = make("target");
  const std::string link = directory_ + "/link";
  ASSERT_EQ(symlink(target.c_str(), link.c_str()), 0);
  setenv("RUNTIME_DIRECTORY", link.c_str(), 1);
  EXPECT_THAT(refusal([] { daemon_directory(); }), HasSubstr("is not a directory"));
}

TEST_F(Rendezvous, ADirectoryOfAnotherUserIsRefused) {
  if (geteuid() == 0) {
    const std::string theirs = make("theirs");
    ASSERT_EQ(chown(theirs.c_str(), 65534, 65534), 0);
    setenv("RUNTIME_DIRECTORY", theirs.c_str(), 1);
  } else {
    setenv("RUNTIME_DIRECTORY", "/usr", 1);
  }
  EXPECT_THAT(refusal([] { daemon_directory(); }), HasSubstr("belongs to user"));
}

TEST_F(Rendezvous, OneListenerAtATimeAndTheNextOneWhenItIsGone) {
  {
    const Listener first = listen_at(directory_, "one");
    EXPECT_EQ(first.path, directory_ + "/one.sock");
    EXPECT_THAT(refusal([&] { listen_at(directory_, "one"); }), HasSubstr("running already"));
    const Listener other = listen_at(directory_, "two");
    EXPECT_TRUE(other.socket);
  }
  EXPECT_TRUE(listen_at(directory_, "one").socket) << "the socket file was left behind";
}

TEST_F(Rendezvous, ASignalIsNoDaemon) {
  next_lock_fails_with = EINTR;
  EXPECT_TRUE(listen_at(directory_, "one").socket);
}

TEST_F(Rendezvous, WithoutLocksTheMessageDoesNotBlameAnotherDaemon) {
  next_lock_fails_with = ENOLCK;
  EXPECT_EQ(refusal([&] { listen_at(directory_, "one"); }),
            "cannot lock " + directory_ + "/one.lock: No locks available");
}

TEST_F(Rendezvous, AClientFindsTheDaemonOfItsInstanceAndNoOther) {
  setenv("RUNTIME_DIRECTORY", directory_.c_str(), 1);
  const Listener listener = listen_at(directory_, "mine");
  std::string why_not;
  EXPECT_TRUE(connect_to_daemon("mine", why_not).has_value());
  EXPECT_EQ(why_not, "");
  EXPECT_FALSE(connect_to_daemon("another-" + std::to_string(getpid()), why_not).has_value());
}

// Whoever listens there could let a client wait, and have any number of sockets there.
TEST_F(Rendezvous, NobodyIsConnectedToInADirectoryOfAnotherUser) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can give a directory away";
  const std::string theirs = make("theirs");
  setenv("RUNTIME_DIRECTORY", theirs.c_str(), 1);
  const Listener listener = listen_at(theirs, "planted");
  ASSERT_EQ(chown(theirs.c_str(), 65534, 65534), 0);
  std::string why_not;
  EXPECT_FALSE(connect_to_daemon("planted", why_not));
  EXPECT_THAT(why_not, HasSubstr(theirs + "/planted.sock: that directory belongs to user 65534"));
  pollfd waiting{listener.socket.get(), POLLIN, 0};
  EXPECT_EQ(poll(&waiting, 1, 0), 0) << "it was connected to";
}

TEST_F(Rendezvous, WhereNobodyAnswersEachSocketThatWasTriedIsNamedWithTheReason) {
  setenv("RUNTIME_DIRECTORY", directory_.c_str(), 1);
  const std::string name = "nobody-" + std::to_string(getpid());
  { const Listener gone = listen_at(directory_, name); }
  std::string why_not;
  EXPECT_FALSE(connect_to_daemon(name, why_not));
  EXPECT_THAT(why_not, HasSubstr("tried " + directory_ + "/" + name + ".sock: nobody listens"));
  EXPECT_THAT(why_not, HasSubstr("/run/arbiter/" + name + ".sock: there is none"));
}

TEST_F(Rendezvous, PathsLongerThanAnAddressWork) {
  std::string deep = directory_;
  for (int i = 0; i < 4; ++i) {
    deep += "/" + std::string(60, static_cast<char>('a' + i));
    ASSERT_EQ(mkdir(deep.c_str(), 0755), 0);
  }
  setenv("RUNTIME_DIRECTORY", deep.c_str(), 1);
  const std::string instance(64, 'i');
  const Listener listener = listen_at(deep, instance);
  std::string why_not;
  EXPECT_TRUE(connect_to_daemon(instance, why_not).has_value());
}

TEST_F(Rendezvous, ADirectoryThatIsNotThereIsNoErrorForAClient) {
  setenv("RUNTIME_DIRECTORY", (directory_ + "/" + std::string(200, 'x')).c_str(), 1);
  std::string why_not;
  EXPECT_FALSE(connect_to_daemon("nobody-" + std::to_string(getpid()), why_not).has_value());
}

}  // namespace
}  // namespace arbiter::wire
