// A component in a time namespace: some containers have a monotonic clock of their own. Nothing
// that it says of its activity would be true for the others.
#include "shm/clock.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

#include <arbiter/arbiter.hpp>

#include "tests/attack/attacker.hpp"
#include "tests/support/daemon.hpp"
#include "wire/meeting.hpp"

namespace arbiter::test {
namespace {

// What making a node says in a time namespace that is so many seconds off.
std::string meet_in_time_namespace(const std::string& offset) {
  if (::unshare(CLONE_NEWTIME) != 0) return "no namespace";
  if (!(std::ofstream("/proc/self/timens_offsets") << "monotonic " << offset << " 0" << std::flush))
    return "no namespace";
  int ends[2];
  if (::pipe(ends) != 0) return "no pipe";
  const pid_t child = ::fork();  // the first that is inside
  if (child == 0) {
    std::string said = "welcome";
    try {
      const Node node("shifted");
    } catch (const Error& error) {
      said = error.what();
    }
    ::_exit(::write(ends[1], said.data(), said.size()) < 0 ? 1 : 0);
  }
  ::waitpid(child, nullptr, 0);
  std::string said(1024, '\0');
  said.resize(static_cast<std::size_t>(std::max<ssize_t>(::read(ends[0], said.data(), 1024), 0)));
  return said;
}

TEST(AnotherClock, IsNotMadeANodeWith) {
  const Daemon daemon;
  for (const std::string offset : {"-100", "100000"}) {
    const Attacked came = run_attack(As::kSameUser, [&] { return meet_in_time_namespace(offset); });
    if (came.said == "done no namespace") GTEST_SKIP() << "no time namespace can be made here";
    // The daemon may have read its clock some time before we read the answer.
    const auto is = came.said.find(" is ");
    ASSERT_NE(is, std::string::npos) << came.said;
    EXPECT_NEAR(std::stod(came.said.substr(is + 4)), std::abs(std::stod(offset)), 50) << came.said;
    EXPECT_NE(came.said.find(offset == "-100" ? "behind" : "ahead of"), std::string::npos);
    EXPECT_NE(came.said.find("time namespace"), std::string::npos) << came.said;
  }
}

TEST(AnotherClock, IsFoundOutHoweverLittleItIsOff) {
  wire::Message welcome;
  const auto asked = shm::monotonic_now();
  const auto fault = [&](shm::Nanoseconds theirs) {
    welcome.peer = static_cast<std::uint64_t>(theirs);
    return wire::find_fault_in_clock(welcome, asked);
  };
  EXPECT_EQ(fault(asked), "");
  EXPECT_EQ(fault(shm::monotonic_now()), "");
  EXPECT_NE(fault(asked - 1), "");
  EXPECT_NE(fault(shm::monotonic_now() + 1'000'000'000), "");
  EXPECT_EQ(fault(0), "");  // a daemon that does not say
}

}  // namespace
}  // namespace arbiter::test
