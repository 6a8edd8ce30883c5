#include "bench/harness/worker.hpp"

#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <thread>

#include "bench/harness/interruption.hpp"
#include "bench/harness/program.hpp"

namespace arbiter::bench {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

bool is_there(pid_t pid) { return ::kill(pid, 0) == 0; }

TEST(Worker, DoesInAProcessOfItsOwnWhatItIsTold) {
  Worker worker("adder", [](Conversation& with) {
    with.say(static_cast<std::uint64_t>(::getpid()));
    for (std::uint64_t word = 0; with.hear_or_end(word);) with.say({word, word + 1});
  });
  const auto pid = static_cast<pid_t>(worker.hear());
  EXPECT_EQ(pid, worker.pid());
  EXPECT_NE(pid, ::getpid());
  worker.say(41);
  EXPECT_THAT(worker.hear_words(), ElementsAre(41, 42));
  worker.say(1);
  EXPECT_THAT(worker.hear_words(), ElementsAre(1, 2));
}

TEST(Worker, SendsHistogramsWhole) {
  Histogram sent;
  for (int i = 0; i < 100'000; ++i) sent.add(i * 1.7);
  Worker worker("measurer", [&](Conversation& with) { with.say(sent); });
  EXPECT_EQ(worker.hear_histogram().words(), sent.words());
}

TEST(Worker, AFailureIsToldWithItsName) {
  Worker worker("sender", [](Conversation&) { throw std::runtime_error("no memory"); });
  EXPECT_THAT([&] { worker.hear(); }, ThrowsMessage<BenchError>("sender: no memory"));
}

TEST(Worker, OneThatDiesIsNamed) {
  Worker worker("receiver", [](Conversation&) { ::raise(SIGKILL); });
  EXPECT_THAT([&] { worker.hear(); }, ThrowsMessage<BenchError>("receiver: has ended"));
}

TEST(Worker, OneThatReturnsWithoutAWordIsNamed) {
  Worker worker("receiver", [](Conversation&) {});
  EXPECT_THAT([&] { worker.hear(); }, ThrowsMessage<BenchError>("receiver: has ended"));
}

TEST(Worker, GoesWithItsObjectInOrderAndLeavesNoChild) {
  int ends[2];
  int answers[2];
  ASSERT_EQ(::pipe(ends), 0);
  ASSERT_EQ(::pipe(answers), 0);
  // Takes its time to take down what it has: until another thread has answered it.
  std::thread other([&] {
    char begun = 0;
    EXPECT_EQ(::read(ends[0], &begun, 1), 1);
    EXPECT_EQ(::write(answers[1], "a", 1), 1);
  });
  pid_t pid = 0;
  {
    const Worker worker("waiter", [&](Conversation& with) {
      for (std::uint64_t word = 0; with.hear_or_end(word);) {
      }
      char answer = 0;
      if (::write(ends[1], "b", 1) != 1 || ::read(answers[0], &answer, 1) != 1) return;
      [[maybe_unused]] const auto written = ::write(ends[1], "e", 1);
    });
    pid = worker.pid();
    EXPECT_TRUE(is_there(pid));
  }
  EXPECT_FALSE(is_there(pid));
  ::close(ends[1]);
  other.join();
  char end = 0;
  EXPECT_EQ(::read(ends[0], &end, 1), 1) << "it was not killed: it came to its end";
  ::close(ends[0]);
  for (const int each : answers) ::close(each);
}

TEST(Worker, OneThatHearsNothingIsKilled) {
  pid_t pid = 0;
  {
    const Worker worker("deaf", [](Conversation&) {
      for (;;) ::pause();
    });
    pid = worker.pid();
  }
  EXPECT_FALSE(is_there(pid));
}

TEST(Worker, OneThatIsReplacedEnds) {
  const auto wait = [](Conversation& with) {
    std::uint64_t word = 0;
    with.hear_or_end(word);
  };
  Worker worker("first", wait);
  const pid_t first = worker.pid();
  worker = Worker("second", wait);
  EXPECT_FALSE(is_there(first));
  EXPECT_TRUE(is_there(worker.pid()));
}

// The signal is sent to the group of the benchmark, as Ctrl-C is.
TEST(Interruption, UnwindsTheBenchmarkAndIsNotHeardByItsWorkers) {
  Worker benchmark("benchmark", [](Conversation& with) {
    remember_interruptions();
    with.say(1);
    with.hear();
    Worker worker("worker", [](Conversation& inner) {
      inner.say(1);
      std::uint64_t word = 0;
      inner.hear_or_end(word);
    });
    worker.hear();
    ::kill(-::getpgrp(), SIGINT);
    try {
      throw_if_interrupted();
      with.say(0);
    } catch (const Interrupted&) {
      with.say(::getpgid(worker.pid()) == worker.pid() ? 1 : 2);
    }
  });
  benchmark.hear();
  // Else it would be these tests that are interrupted.
  ASSERT_EQ(::getpgid(benchmark.pid()), benchmark.pid());
  benchmark.say(1);
  EXPECT_EQ(benchmark.hear(), 1u);
}

TEST(Interruption, EndsAWaitForAWorkersWord) {
  Worker benchmark("benchmark", [](Conversation& with) {
    remember_interruptions();
    const pid_t self = ::getpid();
    Worker worker("worker", [self](Conversation& inner) {
      ::kill(self, SIGTERM);
      std::uint64_t word = 0;
      inner.hear_or_end(word);
    });
    try {
      worker.hear();
    } catch (const Interrupted&) {
      with.say(7);
    }
  });
  EXPECT_EQ(benchmark.hear(), 7u);
}

TEST(Program, EndsWithItsObject) {
  const ScratchDirectory directory;
  pid_t pid = 0;
  {
    const Program program({"/bin/sleep", "1000"}, {}, directory.path() + "/log");
    pid = program.pid();
    EXPECT_TRUE(is_there(pid));
  }
  EXPECT_FALSE(is_there(pid));
}

}  // namespace
}  // namespace arbiter::bench
