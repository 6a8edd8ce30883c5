// Two processes: who is killed, who is not, and who ends by itself.
#include "gateway/core/supervisor.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <fstream>
#include <string>

#include "gateway/core/life_signs.hpp"
#include "shm/file_descriptor.hpp"
#include "tests/support/spoken.hpp"

namespace arbiter::gateway {
namespace {

using test::Spoken;
using testing::HasSubstr;
using testing::StartsWith;

// In milliseconds: how long a worker may be silent, and how long it may take to end.
Spoken supervised(const std::string& mode, int silence, int end) {
  return Spoken(
      {ARBITER_TESTS "/supervised_program", mode, std::to_string(silence), std::to_string(end)});
}

pid_t next_worker(Spoken& program) {
  const std::string line = program.line().value_or("");
  EXPECT_THAT(line, StartsWith("worker "));
  return line.size() > 7 ? std::stoi(line.substr(7)) : 0;
}

// Where a worker may be so slow to begin that it is killed: one that was not before it spoke.
pid_t next_worker_that_is_let_begin(Spoken& program) {
  bool is_killed = false;
  while (const auto line = program.line()) {
    if (line->starts_with("worker ") && !is_killed) return std::stoi(line->substr(7));
    is_killed = line->find("the worker hangs") != std::string::npos;
  }
  ADD_FAILURE() << "no worker has begun";
  return 0;
}

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
  Spoken program = supervised("hang", 200, kLong);
  const pid_t first = next_worker_that_is_let_begin(program);
  EXPECT_THAT(program.line().value_or(""),
              HasSubstr("the worker hangs (no sign of life for 200 ms"));
  EXPECT_EQ(program.line(), "cleaned up after " + std::to_string(first));
  EXPECT_THAT(program.line().value_or(""), HasSubstr("was ended by signal 9 (Killed); another"));
  const pid_t second = next_worker_that_is_let_begin(program);
  EXPECT_NE(second, first);
  ASSERT_GT(second, 0);
  program.process.kill();
  ::kill(second, SIGKILL);  // it would hang on for its ten minutes
}

TEST(Supervisor, KillsAWorkerThatDoesNotEndWhenItIsAskedTo) {
  Spoken program = supervised("beat", kLong, 100);
  const pid_t worker = next_worker(program);
  EXPECT_EQ(program.line(), "beats");
  program.process.signal(SIGTERM);
  EXPECT_THAT(program.line().value_or(""), HasSubstr("did not end within 100 ms: killing it"));
  EXPECT_EQ(program.line(), "cleaned up after " + std::to_string(worker));
  EXPECT_EQ(program.process.wait(), 0);
}

// Somebody looks into it, with a debugger or by SIGSTOP.
TEST(Supervisor, LeavesAWorkerAloneThatIsStopped) {
  Spoken program = supervised("beat", 4000, 100);
  const pid_t worker = next_worker(program);
  EXPECT_EQ(program.line(), "beats");
  ::kill(worker, SIGSTOP);
  EXPECT_THAT(program.line().value_or(""), HasSubstr("the worker is stopped: it is left alone"));
  program.process.signal(SIGTERM);
  EXPECT_THAT(program.line().value_or(""), HasSubstr("did not end"));
  EXPECT_EQ(program.line(), "cleaned up after " + std::to_string(worker));
}

// It asks for the mapping to be read again, which is the supervisor's business.
TEST(Supervisor, AWorkerThatHasOnlyBegunIsNotEndedBySigusr1) {
  Spoken program = supervised("signalled", kLong, 100);
  next_worker(program);
  EXPECT_EQ(program.line(), "beats");
}

// It is asked to by SIGTERM, which it does not heed.
TEST(Supervisor, AWorkerThatHangsEndsWithoutItsSupervisor) {
  Spoken program = supervised("hang", kLong, 100);
  const pid_t worker = next_worker(program);
  program.process.kill();
  EXPECT_THAT(program.line().value_or(""),
              HasSubstr("the supervisor has ended, but the worker did not end within 100 ms: "));
  EXPECT_EQ(program.line(), "cleaned up after " + std::to_string(worker));
  wait_until_ended(worker);
}

TEST(Supervisor, AWorkerWhoseSupervisorLivesIsNotEnded) {
  Spoken program = supervised("hang", kLong, 0);
  next_worker(program);
  program.process.signal(SIGTERM);
  EXPECT_THAT(program.line().value_or(""), HasSubstr("did not end within 0 s: killing it"));
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

// How it ended, and when the next one is started.
std::string next_end(Spoken& program) {
  EXPECT_THAT(program.line().value_or(""), StartsWith("cleaned up after"));
  const std::string line = program.line().value_or("");
  const auto begin = line.find("the worker ");
  return begin == std::string::npos ? line : line.substr(begin + 11);
}

// Its lines must not fill the log: what it has said will hardly change by itself.
TEST(Supervisor, AWorkerThatFailsAgainAndAgainIsStartedEverMoreSeldom) {
  Spoken program = supervised("fail", kLong, 100);
  for (const std::string pause : {"2", "4", "8", "16", "16"}) {
    EXPECT_EQ(next_end(program),
              "ended with exit code 1; another one is started in " + pause + " ms");
  }
}

// It is killed with the middleware's daemon, say, which may be back at once.
TEST(Supervisor, AWorkerThatIsKilledAgainAndAgainIsSoonThereAgain) {
  Spoken program = supervised("crash", kLong, 100);
  for (const std::string pause : {"2", "4", "4", "4"}) {
    EXPECT_EQ(next_end(program),
              "was ended by signal 9 (Killed); another one is started in " + pause + " ms");
  }
}

}  // namespace
}  // namespace arbiter::gateway
