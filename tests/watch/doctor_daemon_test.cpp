// What the doctor finds beside real daemons, and where there is none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <thread>

#include "tests/support/await.hpp"
#include "tests/support/other_user.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/watch/codes_of.hpp"
#include "tests/watch/watched.hpp"
#include "watch/abandoned_sockets.hpp"
#include "watch/doctor.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using watch::Findings;

TEST(Doctor, FindsSocketsWhereNobodyListens) {
  const TemporaryDirectory directory;
  const std::string dead = wire::listen_at(directory.path(), "dead").path;
  const auto alive = wire::listen_at(directory.path(), "alive");
  directory.write("file.sock", "");
  const std::string link = directory.path() + "/a.link";
  fs::rename(wire::listen_at(directory.path(), "was-a-link").path, link);
  fs::create_symlink(dead, directory.path() + "/link.sock");
  EXPECT_THAT(watch::abandoned_sockets(directory.path()), ElementsAre(link, dead));
  EXPECT_THAT(watch::abandoned_sockets(directory.path() + "/none"), IsEmpty());
}

TEST(Doctor, LooksWhereClientsLook) {
  Daemon daemon;
  daemon.kill();
  Findings findings = watch::examine_meeting_places();
  const auto is_ours = [&](const auto& finding) {
    return finding.code == "stale-socket" &&
           finding.mend.find(daemon.socket_path()) != std::string::npos;
  };
  EXPECT_EQ(std::count_if(findings.begin(), findings.end(), is_ours), 1);
  EXPECT_THAT(std::find_if(findings.begin(), findings.end(), is_ours)->why,
              HasSubstr("the daemon of instance " + daemon.instance() + " was killed there"));
  daemon.restart();
  findings = watch::examine_meeting_places();
  EXPECT_EQ(std::count_if(findings.begin(), findings.end(), is_ours), 0);
}

TEST(Doctor, SaysOfWhichInstanceALinkWasKilled) {
  const TemporaryDirectory directory;
  const ScopedVariable session("XDG_RUNTIME_DIR", directory.path());
  const ScopedVariable own("RUNTIME_DIRECTORY", std::nullopt);
  fs::create_directory(directory.path() + "/arbiter");
  const std::string link = directory.path() + "/arbiter/head.link";
  fs::rename(wire::listen_at(directory.path() + "/arbiter", "was-a-link").path, link);
  const Findings findings = watch::examine_meeting_places();
  const auto found = std::find_if(findings.begin(), findings.end(), [&](const auto& each) {
    return each.mend.find(link) != std::string::npos;
  });
  ASSERT_NE(found, findings.end());
  EXPECT_THAT(found->why, AllOf(HasSubstr("the link of instance head was killed there"),
                                HasSubstr("nothing of that instance crosses")));
  EXPECT_THAT(found->mend, HasSubstr("arbiter-link --instance head"));
}

TEST(Doctor, DisturbsNoDaemon) {
  Daemon daemon;
  const auto before = daemon.status()["clients"];
  std::optional<wire::Status> status;
  EXPECT_THAT(codes_of(watch::examine_daemon(caller_of(daemon), status)), IsEmpty());
  ASSERT_TRUE(status);
  EXPECT_EQ(status->pid, daemon.process().pid());
  await([&] { return daemon.status()["clients"] == before; });
}

TEST(Doctor, FindsThatThereIsNoDaemon) {
  Daemon daemon;
  wire::Caller caller = caller_of(daemon);
  caller.instance = "nobody-has-this-instance";
  std::optional<wire::Status> status;
  EXPECT_THAT(codes_of(watch::examine_daemon(caller, status)), ElementsAre("no-daemon"));
  EXPECT_FALSE(status);
  EXPECT_EQ(watch::examine_daemon(caller, status)[0].mend,
            "arbiterd --model FILE --instance nobody-has-this-instance");
}

TEST(Doctor, FindsADaemonThatDoesNotAnswer) {
  Daemon daemon;
  daemon.process().stop();
  wire::Caller caller = caller_of(daemon);
  caller.answer_time = std::chrono::milliseconds(1);
  std::optional<wire::Status> status;
  const Findings findings = watch::examine_daemon(caller, status);
  daemon.process().resume();
  ASSERT_THAT(codes_of(findings), ElementsAre("silent-daemon"));
  const std::string pid = std::to_string(daemon.process().pid());
  EXPECT_THAT(findings[0].what, HasSubstr("(pid " + pid + ")"));
  EXPECT_EQ(findings[0].mend, "kill -CONT " + pid);
}

TEST(Doctor, FindsThatTheDaemonKeepsAUserOut) {
  if (!may_be_another_user()) GTEST_SKIP() << "only root can be another user";
  const TemporaryDirectory files;
  const std::string policy = files.write("policy", "allow user root observe\n");
  Daemon daemon(kNoRules, {.arguments = {"--policy", policy}});
  ASSERT_EQ(::chmod(daemon.directory().c_str(), 0755), 0);
  const std::string said = as_user(kStranger, [&] {
    std::optional<wire::Status> status;
    const Findings findings = watch::examine_daemon(caller_of(daemon), status);
    return findings.size() == 1 ? findings[0].code + ": " + findings[0].what : "not one finding";
  });
  EXPECT_THAT(said, testing::StartsWith("refused: "));
  EXPECT_THAT(said, HasSubstr("may not observe"));
}

// It answers each hello as a daemon of another version does.
class OtherVersion {
 public:
  explicit OtherVersion(const std::string& directory)
      : listener_(wire::listen_at(directory, "test")), thread_([this] { serve(); }) {}
  ~OtherVersion() {
    ::shutdown(listener_.socket.get(), SHUT_RDWR);
    thread_.join();
  }

 private:
  void serve() const {
    for (;;) {
      const shm::FileDescriptor client(
          ::accept4(listener_.socket.get(), nullptr, nullptr, SOCK_CLOEXEC));
      if (!client) return;
      wire::Received hello;
      if (wire::receive_message(client.get(), hello, true) != wire::ReceiveResult::kReceived) {
        continue;
      }
      wire::Message answer;
      answer.kind = wire::MessageKind::kRefused;
      answer.set_text("the client speaks version " + std::to_string(hello.message.value) +
                      ", this daemon version 99");
      static_cast<void>(wire::send_message(client.get(), answer));
    }
  }

  wire::Listener listener_;
  std::thread thread_;
};

TEST(Doctor, FindsADaemonOfAnotherVersion) {
  const TemporaryDirectory directory;
  const ScopedVariable session("XDG_RUNTIME_DIR", directory.path());
  const ScopedVariable own("RUNTIME_DIRECTORY", std::nullopt);
  fs::create_directory(directory.path() + "/arbiter");
  const OtherVersion daemon(directory.path() + "/arbiter");
  std::optional<wire::Status> status;
  wire::Caller caller;
  caller.name = "test";
  caller.instance = "test";
  const Findings findings = watch::examine_daemon(caller, status);
  ASSERT_THAT(codes_of(findings), ElementsAre("other-version"));
  EXPECT_THAT(findings[0].what, HasSubstr("this daemon version 99"));
}

// That is what the real one says to another version.
TEST(Doctor, KnowsWhatADaemonSaysToAnotherVersion) {
  Daemon daemon;
  RawClient client(daemon.instance());
  wire::Message hello = wire::hello_of(caller_of(daemon));
  hello.value = 99;
  client.send(hello);
  wire::Received answer;
  ASSERT_TRUE(client.receive(answer));
  EXPECT_EQ(answer.message.kind, wire::MessageKind::kRefused);
  EXPECT_THAT(std::string(answer.message.text_view()), HasSubstr("speaks version 99"));
}

TEST(Doctor, FindsASecondDaemonOfTheInstance) {
  Daemon daemon;
  const TemporaryDirectory elsewhere;
  const ScopedVariable temporary("TMPDIR", elsewhere.path());
  const std::string directory = elsewhere.path() + "/arbiter-" + std::to_string(::geteuid());
  fs::create_directory(directory);
  ASSERT_EQ(::chmod(directory.c_str(), 0700), 0);
  const auto second = wire::listen_at(directory, daemon.instance());
  std::optional<wire::Status> status;
  const Findings findings = watch::examine_daemon(caller_of(daemon), status);
  ASSERT_THAT(codes_of(findings), ElementsAre("second-daemon"));
  EXPECT_THAT(findings[0].what, AllOf(HasSubstr(second.path), HasSubstr(daemon.socket_path())));
  EXPECT_TRUE(status);
}

}  // namespace
}  // namespace arbiter::test
