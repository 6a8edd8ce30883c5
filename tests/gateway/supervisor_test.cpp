// Two processes: who is killed, who is not, and who ends by itself.
#include "gateway/core/supervisor.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <deque>
#include <fstream>
#include <string>
#include <string_view>

#include "gateway/core/life_signs.hpp"
#include "shm/file_descriptor.hpp"
#include "tests/support/spoken.hpp"

namespace arbiter::gateway {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

// The two processes. What they say, to the log, and what they print are told apart: what is said
// may come a little later.
class Supervised {
 public:
  // In milliseconds: how long a worker may be silent, and how long it may take to end.
  Supervised(const std::string& mode, int silence, int end)
      : program_({ARBITER_TESTS "/supervised_program", mode, std::to_string(silence),
                  std::to_string(end)}) {}

  // The next line; empty: none comes.
  std::string said() { return next(said_); }
  std::string printed() { return next(printed_); }
  // That has begun. One may be so slow that it is killed before.
  pid_t next_worker() {
    constexpr std::string_view kWorker = "worker ";
    for (std::string line; !(line = printed()).empty();) {
      if (line.starts_with(kWorker)) return std::stoi(line.substr(kWorker.size()));
    }
    ADD_FAILURE() << "no worker has begun";
    return 0;
  }
  // Whether something is said that has this in it; what comes before is dropped.
  bool says(const std::string& text) {
    for (std::string line; !(line = said()).empty();) {
      if (line.find(text) != std::string::npos) return true;
    }
    return false;
  }
  test::ChildProcess& process() { return program_.process; }

 private:
  using Lines = std::deque<std::string>;
  std::string next(Lines& wanted) {
    while (wanted.empty()) {
      const auto line = program_.line();
      if (!line) return "";
      (line->starts_with("arbiter-gateway: ") ? said_ : printed_).push_back(*line);
    }
    std::string line = wanted.front();
    wanted.pop_front();
    return line;
  }

  test::Spoken program_;
  Lines said_, printed_;
};

std::string state_of(pid_t process) {
  std::string line;
  std::getline(std::ifstream("/proc/" + std::to_string(process) + "/stat"), line);
  const auto end = line.rfind(") ");
  return end == std::string::npos ? "gone" : line.substr(end + 2, 1);
}

void wait_until_ended(pid_t process) {
  for (std::string state; state != "gone" && state != "Z"; state = state_of(process)) {
    ::usleep(5000);
  }
}

constexpr int kLong = 600'000;

TEST(Supervisor, KillsAWorkerThatHangsAndStartsAnother) {
  Supervised program("hang", 200, kLong);
  const pid_t first = program.next_worker();
  EXPECT_EQ(program.printed(), "cleaned up after " + std::to_string(first));
  EXPECT_TRUE(program.says("the worker hangs (no sign of life for 200 ms"));
  EXPECT_THAT(program.said(), HasSubstr("was ended by signal 9 (Killed); another"));
  const pid_t second = program.next_worker();
  EXPECT_NE(second, first);
  ASSERT_GT(second, 0);
  program.process().kill();
  ::kill(second, SIGKILL);  // it would hang on for its ten minutes
}

TEST(Supervisor, KillsAWorkerThatDoesNotEndWhenItIsAskedTo) {
  Supervised program("beat", kLong, 100);
  const pid_t worker = program.next_worker();
  EXPECT_EQ(program.printed(), "beats");
  program.process().signal(SIGTERM);
  EXPECT_THAT(program.said(), HasSubstr("did not end within 100 ms: killing it"));
  EXPECT_EQ(program.printed(), "cleaned up after " + std::to_string(worker));
  EXPECT_EQ(program.process().wait(), 0);
}

// Somebody looks into it, with a debugger or by SIGSTOP.
TEST(Supervisor, LeavesAWorkerAloneThatIsStopped) {
  Supervised program("beat", 4000, 100);
  const pid_t worker = program.next_worker();
  EXPECT_EQ(program.printed(), "beats");
  ::kill(worker, SIGSTOP);
  EXPECT_THAT(program.said(), HasSubstr("the worker is stopped: it is left alone"));
  program.process().signal(SIGTERM);
  EXPECT_THAT(program.said(), HasSubstr("did not end"));
  EXPECT_EQ(program.printed(), "cleaned up after " + std::to_string(worker));
}

// It asks for the mapping to be read again, which is the supervisor's business.
TEST(Supervisor, AWorkerThatHasOnlyBegunIsNotEndedBySigusr1) {
  Supervised program("signalled", kLong, 100);
  program.next_worker();
  EXPECT_EQ(program.printed(), "beats");
}

// It is asked to by SIGTERM, which it does not heed.
TEST(Supervisor, AWorkerThatHangsEndsWithoutItsSupervisor) {
  Supervised program("hang", kLong, 100);
  const pid_t worker = program.next_worker();
  program.process().kill();
  EXPECT_THAT(program.said(),
              HasSubstr("the supervisor has ended, but the worker did not end within 100 ms: "));
  EXPECT_EQ(program.printed(), "cleaned up after " + std::to_string(worker));
  wait_until_ended(worker);
}

TEST(Supervisor, AWorkerWhoseSupervisorLivesIsNotEnded) {
  Supervised program("hang", kLong, 0);
  program.next_worker();
  program.process().signal(SIGTERM);
  EXPECT_THAT(program.said(), HasSubstr("did not end within 0 s: killing it"));
}

TEST(Supervisor, APipeHasItsReaderUntilItIsClosed) {
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC | O_NONBLOCK), 0);
  shm::FileDescriptor reader(ends[0]);
  const shm::FileDescriptor writer(ends[1]);
  EXPECT_FALSE(has_lost_its_reader(writer.get(), 0));
  while (::write(writer.get(), "beat", 4) > 0) continue;
  EXPECT_FALSE(has_lost_its_reader(writer.get(), 0)) << "one that does not read is there";
  reader.reset();
  EXPECT_TRUE(has_lost_its_reader(writer.get(), -1));
}

bool runs() { return false; }
bool is_stopped() { return true; }

// Looked at each fifth of the time that it may be silent, as the supervisor does.
TEST(LifeSigns, WhoIsSilentForTooLongHangs) {
  LifeSigns signs(100, 0);
  for (const shm::Nanoseconds now : {20, 40, 60, 80}) EXPECT_FALSE(signs.hangs(now, runs)) << now;
  signs.beat(90);
  for (const shm::Nanoseconds now : {100, 140, 189}) EXPECT_FALSE(signs.hangs(now, runs)) << now;
  EXPECT_TRUE(signs.hangs(190, runs));
}

TEST(LifeSigns, WhoIsStoppedDoesNotHangHoweverLong) {
  LifeSigns signs(100, 0);
  shm::Nanoseconds now = 0;
  for (int look = 0; look < 1000; ++look) ASSERT_FALSE(signs.hangs(now += 20, is_stopped)) << now;
  const shm::Nanoseconds resumed = now;
  while (now < resumed + 80)
    EXPECT_FALSE(signs.hangs(now += 20, runs)) << "it has all its time again";
  EXPECT_TRUE(signs.hangs(now + 20, runs));
}

TEST(LifeSigns, TimeInWhichNobodyLookedDoesNotCount) {
  LifeSigns signs(100, 0);
  EXPECT_FALSE(signs.hangs(1'000'000, runs)) << "who looks was stopped, and the other perhaps, too";
  EXPECT_FALSE(signs.hangs(1'000'040, runs));
  EXPECT_FALSE(signs.hangs(1'000'080, runs));
  EXPECT_TRUE(signs.hangs(1'000'100, runs));
}

// Its lines must not fill the log: what it has said will hardly change by itself.
TEST(Supervisor, AWorkerThatFailsAgainAndAgainIsStartedEverMoreSeldom) {
  Supervised program("fail", kLong, 100);
  for (const std::string pause : {"2", "4", "8", "16", "16"}) {
    EXPECT_THAT(program.printed(), StartsWith("cleaned up after"));
    EXPECT_THAT(program.said(), EndsWith("the worker ended with exit code 1; another one is "
                                         "started in " +
                                         pause + " ms"));
  }
}

// It is killed with the middleware's daemon, say, which may be back at once.
TEST(Supervisor, AWorkerThatIsKilledAgainAndAgainIsSoonThereAgain) {
  Supervised program("crash", kLong, 100);
  for (const std::string pause : {"2", "4", "4", "4"}) {
    EXPECT_THAT(program.printed(), StartsWith("cleaned up after"));
    EXPECT_THAT(program.said(), EndsWith("the worker was ended by signal 9 (Killed); another one "
                                         "is started in " +
                                         pause + " ms"));
  }
}

}  // namespace
}  // namespace arbiter::gateway
