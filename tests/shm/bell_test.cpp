#include "shm/bell.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "shm/clock.hpp"
#include "shm/segment.hpp"
#include "tests/support/other_user.hpp"

namespace arbiter::shm {
namespace {

bool is_rung(const Bell& bell) {
  pollfd readable{bell.read_end(), POLLIN, 0};
  return poll(&readable, 1, 0) == 1;
}

TEST(Bell, RingsUntilItIsSilenced) {
  const Bell bell;
  const Ringer ringer(bell.write_end());
  EXPECT_FALSE(is_rung(bell));
  ringer.ring();
  ringer.ring();
  EXPECT_TRUE(is_rung(bell));
  bell.silence();
  EXPECT_FALSE(is_rung(bell));
}

TEST(Bell, WakesOneThatWaitsWithoutALimit) {
  const Bell bell;
  const Ringer ringer(bell.write_end());
  std::thread waiter([&] { bell.wait(kForever); });
  ringer.ring();
  waiter.join();
}

TEST(Bell, ADeadlineThatHasPassedIsNotWaitedFor) {
  const Bell bell;
  bell.wait(monotonic_now() - 1);
  bell.wait(0);
}

TEST(Bell, AWaitThatNobodyRingsForEndsAtItsDeadline) {
  const Bell bell;
  const Nanoseconds deadline = monotonic_now() + 1'000'000;
  while (monotonic_now() < deadline) bell.wait(deadline);
  EXPECT_FALSE(is_rung(bell));
}

TEST(Bell, ManyMoreRingsThanAPipeHoldsDoNotBlockAndAreAllForgotten) {
  const Bell bell;
  const Ringer ringer(bell.write_end());
  for (int i = 0; i < 100'000; ++i) ringer.ring();
  EXPECT_TRUE(is_rung(bell));
  bell.silence();
  EXPECT_FALSE(is_rung(bell));
}

TEST(Bell, OneThatRingsWithoutEndDoesNotKeepTheReceiverFromItsWork) {
  const Bell bell;
  std::atomic<bool> stop{false};
  std::thread hostile([&, end = reopen(bell.write_end(), O_WRONLY | O_NONBLOCK)] {
    const std::vector<char> rings(1 << 16, 1);
    while (!stop) static_cast<void>(!::write(end.get(), rings.data(), rings.size()));
  });
  for (int i = 0; i < 1000; ++i) bell.silence();
  stop = true;
  hostile.join();
}

TEST(Bell, APublisherCanNeitherReadItNorOpenItToBeRead) {
  const auto try_all = [] {
    const Bell bell;
    std::string opened;
    for (const int mode : {O_RDONLY, O_RDWR}) {
      try {
        reopen(bell.write_end(), mode | O_NONBLOCK);
        opened += "opened ";
      } catch (const std::system_error& error) {
        opened += error.code() == std::errc::permission_denied ? "denied " : error.what();
      }
    }
    return opened;
  };
  // Root may open anything, so it does it as somebody else.
  const bool is_root = ::geteuid() == 0;
  EXPECT_EQ(is_root ? test::as_user(test::kNobody, try_all) : try_all(), "denied denied ");
}

TEST(Bell, TheEndThatAPublisherHasCannotBeRead) {
  const Bell bell;
  const FileDescriptor end = reopen(bell.write_end(), O_WRONLY | O_NONBLOCK);
  ring_bell(end.get());
  char byte = 0;
  EXPECT_LT(::read(end.get(), &byte, 1), 0);
  EXPECT_EQ(errno, EBADF);
  EXPECT_TRUE(is_rung(bell));
}

TEST(Bell, APublisherThatSwitchesItsEndToBlockingDoesSoForItselfAlone) {
  const Bell bell;
  const FileDescriptor hostile = reopen(bell.write_end(), O_WRONLY | O_NONBLOCK);
  ASSERT_EQ(fcntl(hostile.get(), F_SETFL, 0), 0);
  const Ringer honest(bell.write_end());
  for (int i = 0; i < 100'000; ++i) honest.ring();  // would block for ever
  EXPECT_TRUE(is_rung(bell));
}

TEST(Bell, RingingForAReceiverThatIsGoneRaisesNoSignalAndLeavesErrnoAlone) {
  ASSERT_NE(signal(SIGPIPE, SIG_DFL), SIG_ERR);  // would end this process
  std::optional<Bell> bell(std::in_place);
  const Ringer ringer(bell->write_end());
  bell.reset();
  errno = 77;
  ringer.ring();
  EXPECT_EQ(errno, 77);
  sigset_t pending;
  sigpending(&pending);
  EXPECT_EQ(sigismember(&pending, SIGPIPE), 0);
}

TEST(Bell, AComponentThatHasTheSignalBlockedFindsItBlockedAfterwards) {
  sigset_t pipe, before, after;
  sigemptyset(&pipe);
  sigaddset(&pipe, SIGPIPE);
  pthread_sigmask(SIG_BLOCK, &pipe, &before);
  std::optional<Bell> bell(std::in_place);
  const Ringer ringer(bell->write_end());
  bell.reset();
  ringer.ring();
  pthread_sigmask(SIG_BLOCK, nullptr, &after);
  EXPECT_EQ(sigismember(&after, SIGPIPE), 1);
  const timespec at_once{};
  while (sigtimedwait(&pipe, nullptr, &at_once) >= 0) {
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

}  // namespace
}  // namespace arbiter::shm
