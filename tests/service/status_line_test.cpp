// How far a model is, while it is proved: to the service manager, or in the log of a terminal.
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>

#include <memory>
#include <sstream>

#include "service/log/log.hpp"
#include "service/models/preparation.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

using namespace std::chrono_literals;
using service::StatusLine;

TEST(StatusLine, WithoutAServiceManagerTheLogHasALineEveryTwoSeconds) {
  const ScopedVariable nobody("NOTIFY_SOCKET", std::nullopt);
  std::ostringstream text;
  const auto before = spdlog::default_logger();
  const auto sink = std::make_shared<spdlog::sinks::ostream_sink_mt>(text);
  const auto logger = std::make_shared<spdlog::logger>("status-line", sink);
  logger->set_pattern("%v");
  spdlog::set_default_logger(logger);
  {
    StatusLine::Clock::time_point now;
    StatusLine line("test", [&now] { return now; });
    const auto watch = line.watch();
    const auto at = [&](std::chrono::milliseconds time, const rules::Progress& progress) {
      now = StatusLine::Clock::time_point(time);
      watch(progress);
    };
    at(1999ms, {"proving", 1, 9, "/p"});
    at(2000ms, {});  // nothing has begun
    at(2001ms, {"proving", 2, 9, "/p"});
    at(4000ms, {"proving", 3, 9, "/q"});
    at(4001ms, {"proving", 4, 9, "/q"});
  }
  spdlog::set_default_logger(before);
  EXPECT_EQ(text.str(), "proving: 2 of 9 ports (/p)\nproving: 4 of 9 ports (/q)\n");
}

}  // namespace
}  // namespace arbiter::test
