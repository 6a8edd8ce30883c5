// What a stranger can do with a bell, who may ring it.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>

#include <chrono>
#include <string>

#include "tests/attack/attacker.hpp"
#include "tests/attack/prey.hpp"
#include "tests/support/other_user.hpp"
#include "tests/support/threads.hpp"

namespace {

using namespace std::chrono_literals;
using arbiter::shm::FileDescriptor;
using arbiter::test::As;
using arbiter::test::may_be_another_user;
using arbiter::test::Prey;
using arbiter::test::run_attack;

std::string own_path(int fd) { return "/proc/self/fd/" + std::to_string(fd); }

// Rings until nothing more goes in.
std::string fill(int bell) {
  const FileDescriptor again(::open(own_path(bell).c_str(), O_WRONLY | O_NONBLOCK));
  if (!again) return "cannot ring";
  const std::string many(4096, '!');
  while (::write(again.get(), many.data(), many.size()) > 0) {
  }
  return errno == EAGAIN ? "full" : "not full";
}

class ABell : public testing::Test {
 protected:
  void SetUp() override {
    if (!may_be_another_user()) GTEST_SKIP() << "only root can become another user";
  }
};

TEST_F(ABell, CannotBeReadByAStranger) {
  Prey prey;
  const int bell = prey.bell.get();
  EXPECT_EQ(
      run_attack(As::kAnotherUser,
                 [&] {
                   std::string succeeded;
                   char byte = 0;
                   if (::read(bell, &byte, 1) >= 0) succeeded += "read; ";
                   for (const int flags : {O_RDONLY, O_RDWR}) {
                     const FileDescriptor again(::open(own_path(bell).c_str(), flags | O_NONBLOCK));
                     if (again) succeeded += "reopen; ";
                   }
                   if (::fchmod(bell, 0666) == 0) succeeded += "change the mode; ";
                   return succeeded;
                 })
          .said,
      "done ");
}

TEST_F(ABell, WhichAStrangerFillsHoldsUpNoPublisherAndStillWakes) {
  Prey prey;
  const int bell = prey.bell.get();
  arbiter::Node node("honest");
  auto out = node.output_port<int>("/honest:o");  // before the flood
  EXPECT_EQ(run_attack(As::kAnotherUser, [&] { return fill(bell); }).said, "done full");
  EXPECT_EQ(prey.in().wait_for(0ms).status(), arbiter::WaitStatus::timeout);
  arbiter::test::Watched waiting([&] {
    // The flood may wake it; it finds nothing, empties the bell, and sleeps again.
    while (!prey.in().wait_for(1h).idle()) {
    }
  });
  EXPECT_EQ(run_attack(As::kAnotherUser, [&] { return fill(bell); }).said, "done full");
  // The honest publishers' calls return, whatever the bell is like.
  for (int i = 0; i < 1000; ++i) {
    static_cast<void>(prey.out().publish(i));
    prey.out().deactivate();
    static_cast<void>(out.signal());
  }
  // The daemon is the one who rings when the attacker goes, and when a model comes.
  prey.daemon().load(R"(<behaviors timeout="forever">
    <arbiter at="/prey:i"><select from="/honest:o">not /stop:o</select></arbiter>
  </behaviors>)");
  static_cast<void>(out.publish(7));
  auto stop = node.output_port<void>("/stop:o");
  const auto taken = prey.daemon().input("/prey:i")["taken"];
  EXPECT_EQ(out.publish(8).delivered, 1u);
  // Of what it has not seen it is not told.
  while (prey.daemon().input("/prey:i")["taken"] == taken) {
  }
  static_cast<void>(stop.signal());  // overrides without commanding: the port is idle, once
  waiting.join();
}

// The descriptor that peers get is one that the daemon does not use itself.
TEST_F(ABell, WhoseDescriptorAStrangerMakesBlockDoesNotHoldUpTheDaemon) {
  Prey prey;
  const int bell = prey.bell.get();
  EXPECT_EQ(run_attack(As::kAnotherUser,
                       [&] {
                         if (::fcntl(bell, F_SETFL, 0) != 0) return std::string("cannot");
                         return fill(bell);
                       })
                .said,
            "done full");
  prey.daemon().load(arbiter::test::kNoRules);  // rings all bells
  EXPECT_EQ(prey.daemon().status()["model"]["generation"], 2);
}

}  // namespace
