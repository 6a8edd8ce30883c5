// Two processes: who is killed, who is not, and who ends by itself.
#include "gateway/core/supervisor.hpp"

#include <gmock/gmock.h>
#include <signal.h>

#include <fstream>
#include <string>

#include "shm/clock.hpp"
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
  const pid_t first = next_worker(program);
  EXPECT_THAT(program.line().value_or(""),
              HasSubstr("the worker hangs (no sign of life for 200 ms"));
  EXPECT_EQ(program.line(), "cleaned up after " + std::to_string(first));
  EXPECT_THAT(program.line().value_or(""), HasSubstr("was ended by signal 9 (Killed); another"));
  EXPECT_NE(next_worker(program), first);
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
  Spoken program = supervised("beat", 1000, 100);
  const pid_t worker = next_worker(program);
  EXPECT_EQ(program.line(), "beats");
  ::kill(worker, SIGSTOP);
  const auto stopped = shm::monotonic_now();
  while (shm::monotonic_now() - stopped < 2'500'000'000) ::usleep(5000);
  ::kill(worker, SIGCONT);
  program.process.signal(SIGTERM);
  EXPECT_THAT(program.line().value_or(""), HasSubstr("did not end"));
  EXPECT_EQ(program.line(), "cleaned up after " + std::to_string(worker));
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
  const pid_t worker = next_worker(program);
  ::usleep(100'000);
  EXPECT_EQ(state_of(worker), "S");
  program.process.signal(SIGTERM);
  EXPECT_THAT(program.line().value_or(""), HasSubstr("did not end within 0 s: killing it"));
}

}  // namespace
}  // namespace arbiter::gateway
