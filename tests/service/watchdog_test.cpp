// A service manager that watches the daemon hears from its loop, and hears nothing once it hangs.
#include "service/watchdog.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstring>

#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

class AWatchdog : public testing::Test {
 protected:
  // Of those that came since it was last asked.
  int messages() {
    int count = 0;
    char text[64];
    ssize_t size = 0;
    while ((size = ::recv(manager_.get(), text, sizeof text, MSG_DONTWAIT)) > 0) {
      EXPECT_EQ(std::string(text, static_cast<std::size_t>(size)), "WATCHDOG=1");
      ++count;
    }
    return count;
  }

  AWatchdog() {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(manager_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }

  TemporaryDirectory directory_;
  std::string path_ = directory_.path() + "/notify";
  shm::FileDescriptor manager_{::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)};
  ScopedVariable notify_{"NOTIFY_SOCKET", path_};
  ScopedVariable process_{"WATCHDOG_PID", std::to_string(::getpid())};
};

TEST_F(AWatchdog, HearsTwiceInItsInterval) {
  const ScopedVariable interval("WATCHDOG_USEC", "10000000");
  service::Watchdog watchdog;
  constexpr shm::Nanoseconds kSecond = 1'000'000'000;
  const shm::Nanoseconds start = 77 * kSecond;
  watchdog.go_round(start);
  EXPECT_EQ(messages(), 1);
  EXPECT_EQ(watchdog.deadline(), start + 5 * kSecond);
  for (shm::Nanoseconds now = start; now < start + 5 * kSecond; now += kSecond / 4) {
    watchdog.go_round(now);
  }
  EXPECT_EQ(messages(), 0) << "not more often, however fast the loop goes round";
  watchdog.go_round(start + 5 * kSecond);
  watchdog.go_round(start + 6 * kSecond);
  watchdog.go_round(start + 12 * kSecond);
  EXPECT_EQ(messages(), 2);
}

TEST_F(AWatchdog, ThatNobodyAsksForSaysNothing) {
  for (const char* interval : {"0", "", "18446744073709551615"}) {
    const ScopedVariable asked("WATCHDOG_USEC", interval);
    service::Watchdog watchdog;
    watchdog.go_round(1);
    EXPECT_EQ(watchdog.deadline(), shm::kForever) << interval;
    EXPECT_EQ(messages(), 0);
  }
  const ScopedVariable asked("WATCHDOG_USEC", "10000000");
  const ScopedVariable another("WATCHDOG_PID", "1");
  service::Watchdog watchdog;
  watchdog.go_round(1);
  EXPECT_EQ(messages(), 0) << "another process is meant";
}

TEST(TheDaemon, TellsItsWatchdogThatItsLoopGoesRound) {
  const ScopedVariable interval("WATCHDOG_USEC", "1000");
  Daemon daemon;
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(daemon.notify().wait_for("WATCHDOG=1", daemon.process()));
}

}  // namespace
}  // namespace arbiter::test
