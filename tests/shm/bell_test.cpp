#include "shm/bell.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <optional>
#include <thread>

#include "shm/clock.hpp"
#include "shm/segment.hpp"

namespace arbiter::shm {
namespace {

bool is_rung(const Bell& bell) {
  pollfd readable{bell.read_end(), POLLIN, 0};
  return poll(&readable, 1, 0) == 1;
}

TEST(Bell, rings_until_it_is_silenced) {
  const Bell bell;
  const Ringer ringer(bell.write_end());
  EXPECT_FALSE(is_rung(bell));
  ringer.ring();
  ringer.ring();
  EXPECT_TRUE(is_rung(bell));
  bell.silence();
  EXPECT_FALSE(is_rung(bell));
}

TEST(Bell, wakes_one_that_waits_without_a_limit) {
  const Bell bell;
  const Ringer ringer(bell.write_end());
  std::thread waiter([&] { bell.wait(kForever); });
  ringer.ring();
  waiter.join();
}

TEST(Bell, a_deadline_that_has_passed_is_not_waited_for) {
  const Bell bell;
  bell.wait(monotonic_now() - 1);
  bell.wait(0);
}

TEST(Bell, a_wait_that_nobody_rings_for_ends_at_its_deadline) {
  const Bell bell;
  const Nanoseconds deadline = monotonic_now() + 1'000'000;
  while (monotonic_now() < deadline) bell.wait(deadline);
  EXPECT_FALSE(is_rung(bell));
}

TEST(Bell, many_more_rings_than_a_pipe_holds_do_not_block_and_are_all_forgotten) {
  const Bell bell;
  const Ringer ringer(bell.write_end());
  for (int i = 0; i < 100'000; ++i) ringer.ring();
  EXPECT_TRUE(is_rung(bell));
  bell.silence();
  EXPECT_FALSE(is_rung(bell));
}

TEST(Bell, a_publisher_can_neither_read_it_nor_open_it_to_be_read) {
  if (geteuid() == 0) GTEST_SKIP() << "root may open anything";
  const Bell bell;
  EXPECT_THROW(reopen(bell.write_end(), O_RDONLY | O_NONBLOCK), std::system_error);
  EXPECT_THROW(reopen(bell.write_end(), O_RDWR | O_NONBLOCK), std::system_error);
}

TEST(Bell, the_end_that_a_publisher_has_cannot_be_read) {
  const Bell bell;
  const FileDescriptor end = reopen(bell.write_end(), O_WRONLY | O_NONBLOCK);
  ring_bell(end.get());
  char byte = 0;
  EXPECT_LT(::read(end.get(), &byte, 1), 0);
  EXPECT_EQ(errno, EBADF);
  EXPECT_TRUE(is_rung(bell));
}

TEST(Bell, a_publisher_that_switches_its_end_to_blocking_does_so_for_itself_alone) {
  const Bell bell;
  const FileDescriptor hostile = reopen(bell.write_end(), O_WRONLY | O_NONBLOCK);
  ASSERT_EQ(fcntl(hostile.get(), F_SETFL, 0), 0);
  const Ringer honest(bell.write_end());
  for (int i = 0; i < 100'000; ++i) honest.ring();  // would block for ever
  EXPECT_TRUE(is_rung(bell));
}

TEST(Bell, ringing_for_a_receiver_that_is_gone_raises_no_signal_and_leaves_errno_alone) {
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

TEST(Bell, a_component_that_has_the_signal_blocked_finds_it_blocked_afterwards) {
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
