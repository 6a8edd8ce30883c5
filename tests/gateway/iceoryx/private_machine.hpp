// A /tmp and a /dev/shm of the test's own: iceoryx has one RouDi there, whose name nobody can
// change.
#pragma once

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>

namespace arbiter::test {

// What the test before has left behind is not seen any more.
inline std::string empty_machine() {
  for (const char* directory : {"/tmp", "/dev/shm"}) {
    ::umount2(directory, MNT_DETACH);
    if (::mount("tmpfs", directory, "tmpfs", 0, "mode=1777") != 0) {
      return std::string(directory) + ": " + std::strerror(errno);
    }
  }
  return {};
}

// Enters namespaces of this process's own; those that it starts inherit them. Empty, or why not.
inline std::string enter_private_machine() {
  const auto failed = [](const char* what) {
    return std::string(what) + ": " + std::strerror(errno);
  };
  const uid_t user = ::geteuid();
  const gid_t group = ::getegid();
  if (::unshare(CLONE_NEWNS | (user == 0 ? 0 : CLONE_NEWUSER)) != 0) return failed("unshare");
  if (user != 0) {
    std::ofstream("/proc/self/setgroups") << "deny";
    std::ofstream("/proc/self/uid_map") << user << ' ' << user << " 1";
    std::ofstream("/proc/self/gid_map") << group << ' ' << group << " 1";
  }
  if (::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) return failed("mount /");
  return empty_machine();
}

// A member that is made first.
struct EmptyMachine {
  EmptyMachine() { EXPECT_EQ(empty_machine(), ""); }
};

// Before the first test of the program runs: while it has one thread.
class PrivateMachine : public testing::Environment {
 public:
  void SetUp() override {
    const std::string why_not = enter_private_machine();
    if (!why_not.empty()) GTEST_SKIP() << "no namespaces of its own: " << why_not;
  }
};

}  // namespace arbiter::test
