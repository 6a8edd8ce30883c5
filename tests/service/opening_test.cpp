// Ports that are opened while there is no daemon, or one that does not answer.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include <arbiter/arbiter.hpp>

#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/service/impatient.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

TEST(Takeover, OpeningWaitsForADaemon) {
  Daemon daemon(single_model());
  std::atomic<bool> is_killed{false};  // before, one that is slow to answer may be waited for
  const auto patient = [&is_killed](std::atomic<int>& told) {
    NodeOptions options;
    options.connect_timeout = std::chrono::hours(1);
    options.on_waiting = [&told, &is_killed](const std::string& text) {
      if (!is_killed) return;
      EXPECT_NE(text.find("waits for an arbiterd of instance \"test\""), std::string::npos) << text;
      ++told;
    };
    return options;
  };
  std::atomic<int> early_told{0};
  std::atomic<int> late_told{0};
  Node node("early", patient(early_told));
  daemon.kill();
  is_killed = true;
  std::thread opener([&] { auto out = node.output_port<Number>("/out"); });
  std::thread starter([&] { Node("late", patient(late_told)); });
  while (early_told == 0 || late_told == 0) {
  }
  daemon.restart();
  opener.join();
  starter.join();
  EXPECT_EQ(early_told, 1);
  EXPECT_EQ(late_told, 1);
}

TEST(Takeover, OpeningWithoutADaemonEndsInTime) {
  Daemon daemon(single_model());
  Node node = impatient_node("test");
  daemon.kill();
  try {
    auto out = node.output_port<Number>("/out");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("no arbiterd of instance \"test\" answered"),
              std::string::npos)
        << error.what();
  }
  daemon.restart();
  auto out = at_last([&] { return node.output_port<Number>("/out"); });
}

TEST(Takeover, OpeningWhileTheDaemonIsStoppedEndsInTime) {
  Daemon daemon(single_model());
  Node node = impatient_node("test");
  daemon.process().stop();
  try {
    auto out = node.output_port<Number>("/out");
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "the daemon is there, but has not answered in time");
  }
  daemon.process().signal(SIGCONT);
  // What it opens too late is closed again.
  auto out = at_last([&] { return node.output_port<Number>("/other"); });
  await([&] { return daemon.source("/out")["open"] != true; });
}

}  // namespace
}  // namespace arbiter::test
