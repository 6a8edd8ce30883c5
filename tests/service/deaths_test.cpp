// Who has died is told of for a while, and nobody can push it out of what others are told.
#include "service/takeover/deaths.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "service/kept/process.hpp"
#include "tests/support/await.hpp"

namespace arbiter::service {
namespace {

using testing::Field;

void note(Deaths& deaths, const std::string& node, std::uint32_t user) {
  deaths.note({EventKind::kDied, {node}}, 1, user);
}

TEST(Deaths, AreTheLatestOnes) {
  Deaths deaths;
  for (std::size_t i = 0; i < Deaths::kMost + 4; ++i) note(deaths, std::to_string(i), 7);
  ASSERT_EQ(deaths.all().size(), Deaths::kMost);
  EXPECT_EQ(deaths.all().front().node, std::to_string(Deaths::kMost + 3));
  EXPECT_EQ(deaths.all().back().node, "4");
}

TEST(Deaths, OfOneUserPushOutNoneOfAnother) {
  Deaths deaths;
  note(deaths, "stop", 8);
  for (std::size_t i = 0; i < 3 * Deaths::kMost; ++i) note(deaths, std::to_string(i), 7);
  EXPECT_EQ(deaths.all().size(), Deaths::kMost);
  EXPECT_THAT(deaths.all(), testing::Contains(Field(&wire::DeathStatus::node, "stop")));
}

TEST(Deaths, SayWhichPortsHaveBeenOpenedSince) {
  Deaths deaths;
  deaths.note({EventKind::kDied, {"arm"}, {"/out", "/other"}, {"/in"}}, 1, 7);
  deaths.note_input_opened("/out");
  EXPECT_THAT(deaths.all()[0].opened_since, testing::IsEmpty()) << "an input port of that name";
  deaths.note_output_opened("/out");
  deaths.note_output_opened("/out");
  deaths.note_input_opened("/in");
  EXPECT_THAT(deaths.all()[0].opened_since, testing::ElementsAre("/out", "/in"));
  deaths.note({EventKind::kDied, {"arm"}, {"/out"}, {}}, 2, 7);
  EXPECT_THAT(deaths.all()[0].opened_since, testing::IsEmpty());
}

// A process that waits until it is let go; the test's own child, for which it has to wait.
class Child {
 public:
  // Its first thread may end before another one.
  explicit Child(bool first_thread_ends = false) {
    if (::pipe2(ends_, O_CLOEXEC) != 0) throw std::runtime_error("pipe");
    pid_ = ::fork();
    if (pid_ != 0) return;
    ::close(ends_[1]);
    const auto wait_and_end = [this] {
      char byte = 0;
      static_cast<void>(!::read(ends_[0], &byte, 1));
      ::_exit(0);
    };
    if (!first_thread_ends) wait_and_end();
    std::thread(wait_and_end).detach();
    ::syscall(SYS_exit, 0);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    let_go();
    ::waitpid(pid_, nullptr, 0);
    ::close(ends_[0]);
  }

  [[nodiscard]] pid_t pid() const { return pid_; }
  void let_go() {
    ::close(std::exchange(ends_[1], -1));
    siginfo_t ended{};
    ::waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOWAIT);  // it stays a zombie
  }

 private:
  int ends_[2] = {-1, -1};
  pid_t pid_ = 0;
};

char state_of(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string line;
  std::getline(file, line);
  return line.at(line.rfind(')') + 2);
}

TEST(Process, ThatHasEndedDoesNotLiveThoughNobodyHasWaitedForIt) {
  Child child;
  const Process process{child.pid(), start_of_process(child.pid())};
  EXPECT_TRUE(process.lives());
  EXPECT_FALSE((Process{child.pid(), 0}).lives()) << "when it began is not known";
  EXPECT_FALSE((Process{child.pid(), process.started + 1}).lives()) << "that was another one";
  child.let_go();
  ASSERT_EQ(state_of(child.pid()), 'Z');
  EXPECT_FALSE(process.lives());
}

TEST(Process, WhoseFirstThreadHasEndedLives) {
  Child child(true);
  const Process process{child.pid(), start_of_process(child.pid())};
  test::await([&] { return state_of(child.pid()) == 'Z'; });
  EXPECT_TRUE(process.lives());
  EXPECT_FALSE(is_ending(child.pid())) << "another thread goes on";
}

TEST(Process, ThatHasNoMemoryIsEnding) {
  Child child;
  EXPECT_FALSE(is_ending(child.pid()));
  child.let_go();
  EXPECT_TRUE(is_ending(child.pid()));
  EXPECT_FALSE(is_ending(0)) << "it cannot be told";
}

}  // namespace
}  // namespace arbiter::service
