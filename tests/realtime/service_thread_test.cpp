// The service thread keeps out of the way of real-time threads, and is not kept by them from doing
// its work.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

std::vector<unsigned> cpus_of(pid_t task) {
  cpu_set_t set;
  CPU_ZERO(&set);
  ::sched_getaffinity(task, sizeof set, &set);
  std::vector<unsigned> cpus;
  for (unsigned cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(cpu, &set)) cpus.push_back(cpu);
  }
  return cpus;
}

void pin_to(unsigned cpu) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(cpu, &set);
  ASSERT_EQ(::pthread_setaffinity_np(::pthread_self(), sizeof set, &set), 0);
}

bool become_fifo() {
  const sched_param priority{10};
  return ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &priority) == 0;
}

// Its task; a test has one node with one.
pid_t service_thread() {
  for (;;) {
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
      std::ifstream file(entry.path() / "comm");
      std::string name;
      std::getline(file, name);
      if (name == "arbiter-service") return std::stoi(entry.path().filename());
    }
  }
}

// Runs it on a thread of its own, so that what it does to itself ends with it.
void on_a_thread(const std::function<void()>& act) { std::thread(act).join(); }

TEST(ServiceThread, IsOfLowPriorityWhateverItsMakerIs) {
  Daemon daemon;
  on_a_thread([] {
    if (!become_fifo()) GTEST_SKIP() << "needs the right to SCHED_FIFO (ulimit -r)";
    Node node("test");
    auto out = node.output_port<Number>("/out");  // by now it has begun
    EXPECT_EQ(::sched_getscheduler(service_thread()), SCHED_OTHER);
    EXPECT_EQ(::getpriority(PRIO_PROCESS, static_cast<id_t>(service_thread())), 5);
  });
}

TEST(ServiceThread, RunsWhereItsMakerMayUnlessItIsToldWhere) {
  Daemon daemon;
  const std::vector<unsigned> all = cpus_of(0);
  on_a_thread([&] {
    pin_to(all.back());
    {
      Node node("test");
      auto out = node.output_port<Number>("/out");
      EXPECT_EQ(cpus_of(service_thread()), std::vector<unsigned>{all.back()});
    }
    NodeOptions options;
    options.service_cpus = {all.front()};
    Node node("test", options);
    auto out = node.output_port<Number>("/out");
    EXPECT_EQ(cpus_of(service_thread()), options.service_cpus);
    EXPECT_EQ(cpus_of(0), std::vector<unsigned>{all.back()});
  });
}

TEST(ServiceThread, CannotBeSentWhereNoProcessorIs) {
  Daemon daemon;
  NodeOptions options;
  options.service_cpus = {CPU_SETSIZE - 1, 1'000'000};
  try {
    Node node("test", options);
    FAIL() << "there is no such processor";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("service_cpus"));
  }
}

// A control loop that polls: it has a processor for itself, and never gives it up.
TEST(ServiceThread, HearsOfANewPeerWhileItsMakerSpins) {
  Daemon daemon(single_model());
  const std::vector<unsigned> all = cpus_of(0);
  if (all.size() < 2) GTEST_SKIP() << "needs two processors";
  Node other("other");
  std::promise<bool> is_open;
  std::thread loop([&] {
    pin_to(all.back());
    NodeOptions options;
    options.service_cpus = {all.front()};
    const bool is_fifo = become_fifo();
    Node node("test", options);
    auto out = node.output_port<Number>("/out");
    is_open.set_value(is_fifo);
    while (out.publish(Number{1}).delivered == 0) {
    }
  });
  const bool is_fifo = is_open.get_future().get();
  auto in = other.input_port<Number>("/in");
  loop.join();
  EXPECT_TRUE(in.take());
  if (!is_fifo) GTEST_SKIP() << "needs the right to SCHED_FIFO (ulimit -r)";
}

}  // namespace
}  // namespace arbiter::test
