// Questions that are put on a thread of their own.
#include "top/inquirer.hpp"

#include <gtest/gtest.h>

#include <condition_variable>
#include <future>
#include <mutex>
#include <stop_token>

#include "tests/watch/watched.hpp"

namespace arbiter::top {
namespace {

TEST(TopInquirer, AsksAQuestionThatIsUnderWayToStopWhenItEnds) {
  const test::Daemon daemon("<behaviors/>");
  std::promise<void> begun;
  bool has_stopped = false;
  const auto explain = [&](const auto& /*instance*/, const auto& /*models*/, const WhyQuestion&,
                           const std::stop_token& stop) {
    begun.set_value();
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any never;
    never.wait(lock, stop, [] { return false; });
    has_stopped = true;
    return std::string();
  };
  {
    Inquirer inquirer(test::watched(daemon), explain);
    inquirer.ask({{"/p:i"}, ""});
    begun.get_future().wait();
  }
  EXPECT_TRUE(has_stopped);
}

}  // namespace
}  // namespace arbiter::top
