// A user with too many descriptors under way, in messages that nobody has read: the kernel lets his
// other programs send none. What a component has to say then waits until it may.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <array>
#include <span>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/support/daemon.hpp"
#include "tests/support/descriptor_limit.hpp"
#include "tests/support/lingering.hpp"
#include "tests/support/other_user.hpp"

namespace arbiter::test {
namespace {

using shm::FileDescriptor;

// They are read while the port's opening waits for the daemon's answer.
std::string open_behind_a_flood() {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) return "no pair";
  FileDescriptor flood(ends[0]), unread(ends[1]);
  bool has_waited = false;
  NodeOptions options;
  options.on_waiting = [&](const std::string&) {
    has_waited = true;
    flood.reset();
    unread.reset();
  };
  Node node("crowded", options);
  const DescriptorLimit limit(256);
  const std::vector<int> many(200, flood.get());
  const std::array<std::byte, 1> message{};
  while (test::try_to_send_with(flood.get(), message, many)) {
  }
  auto port = node.output_port<int>("/crowded:o");
  return has_waited ? "opened behind them" : "opened beside them";
}

TEST(UnderWay, APortOpensOnceTheOthersHaveBeenRead) {
  if (!may_be_another_user()) GTEST_SKIP() << "root may have any number under way";
  Daemon daemon;
  ASSERT_EQ(::chmod(daemon.directory().c_str(), 0711), 0);
  EXPECT_EQ(as_user(kStranger, open_behind_a_flood), "opened behind them");
}

}  // namespace
}  // namespace arbiter::test
