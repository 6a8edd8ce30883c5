// What is said where what was recorded cannot be written as fast.
#include <gtest/gtest.h>

#include <future>
#include <mutex>
#include <semaphore>
#include <string>

#include <arbiter/arbiter.hpp>

#include "recorder/recorder.hpp"
#include "shm/clock.hpp"
#include "tests/recorder/recording.hpp"
#include "tests/support/await.hpp"

namespace arbiter::test {
namespace {

// Nothing is written until it may be.
class HeldSink : public recorder::Sink {
 public:
  void write(const recorder::RecordPtr& /*record*/) override {
    may_write_.acquire();
    may_write_.release();
  }
  void tick(evidence::Nanoseconds, evidence::Nanoseconds) override {}
  void finish(evidence::Nanoseconds) override {}
  void let_go() { may_write_.release(); }

 private:
  std::counting_semaphore<> may_write_{0};
};

class SlowDisk : public testing::Test {
 protected:
  recorder::RecorderOptions options() {
    recorder::RecorderOptions options;
    options.caller.name = "test";
    options.caller.instance = options.node.instance = daemon_.instance();
    options.say = [this](const std::string& text) {
      const std::lock_guard lock(mutex_);
      said_ += text + '\n';
    };
    return options;
  }
  // Lets the sink go once this is said.
  void see(const std::string& text) {
    await([&] {
      const std::lock_guard lock(mutex_);
      return said_.find(text) != std::string::npos;
    });
    sink_.let_go();
  }

  Daemon daemon_{kLasting};
  HeldSink sink_;
  std::mutex mutex_;
  std::string said_;  // under it
};

TEST_F(SlowDisk, WhoWaitsForTheEndIsTold) {
  const auto settings = options();
  recorder::Recorder recorder(settings, sink_);
  auto end = std::async(std::launch::async, [&] { return recorder.finish(); });
  see("still writing, for the disk is slow; `kill -9 ");
  EXPECT_EQ(end.get().arrivals, 0u);
}

// The end may be hours later.
TEST_F(SlowDisk, IsToldWhereSomethingIsMissingForIt) {
  auto settings = options();
  settings.queue_bytes = 10'000;
  Node node("test", settings.node);
  auto low = node.output_port<int>("/low");
  recorder::Recorder recorder(settings, sink_);
  constexpr std::uint64_t kMany = 1000;  // a publisher keeps 1024 events
  for (std::uint64_t i = 0; i < kMany; ++i) low.signal();
  recorder.run(shm::monotonic_now(), -1, [] { return true; });
  see("the disk is slow, and ");
  const recorder::Recorded recorded = recorder.finish();
  EXPECT_GT(recorded.lost_events, 0u);
  EXPECT_EQ(recorded.arrivals + recorded.lost_events, kMany);
}

}  // namespace
}  // namespace arbiter::test
