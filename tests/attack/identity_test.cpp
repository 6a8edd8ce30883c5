// Somebody who says that he is a component that was here before.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>

#include <optional>
#include <stdexcept>
#include <string>

#include <arbiter/arbiter.hpp>

#include "tests/support/daemon.hpp"
#include "tests/support/other_user.hpp"

namespace arbiter::test {
namespace {

using wire::MessageKind;

// Processes that are started meanwhile see none of those that are here: to them, all have the
// number 0.
class InANamespaceOfItsOwn {
 public:
  InANamespaceOfItsOwn() : before_(::open("/proc/self/ns/pid", O_RDONLY | O_CLOEXEC)) {
    if (!before_ || ::unshare(CLONE_NEWPID) != 0) throw std::runtime_error("no PID namespace");
  }
  InANamespaceOfItsOwn(const InANamespaceOfItsOwn&) = delete;
  InANamespaceOfItsOwn& operator=(const InANamespaceOfItsOwn&) = delete;
  ~InANamespaceOfItsOwn() { ::setns(before_.get(), CLONE_NEWPID); }

 private:
  shm::FileDescriptor before_;
};

// Comes back as each of the nodes that there may have been.
std::string come_back_as_others(const std::string& instance) {
  RawClient known(instance);
  const wire::Received welcome = known.hello("thief");
  auto hello = RawClient::hello_message("thief", wire::kRejoins | wire::kComesBack);
  for (hello.link = 1; hello.link < welcome.message.link; ++hello.link) {
    RawClient thief(instance);
    thief.send(hello, {welcome.descriptors[0].get(), welcome.descriptors[1].get()});
    if (thief.expect(MessageKind::kWelcome).message.link == hello.link) return "is another";
    thief.send(RawClient::message(MessageKind::kHandedBack));
    thief.status();
  }
  return "is nobody else";
}

TEST(AComponentOutsideOfTheDaemonsPidNamespace, IsNotTakenForAnother) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can make a PID namespace, and other users";
  std::optional<Daemon> daemon;
  {
    const InANamespaceOfItsOwn inside;
    daemon.emplace();
  }
  ASSERT_EQ(::chmod(daemon->directory().c_str(), 0711), 0);
  Node node("honest");
  const auto port = node.output_port<int>("/honest:o");
  ASSERT_EQ(daemon->source("/honest:o")["component"]["pid"], 0) << "the daemon sees us";
  EXPECT_EQ(as_user(kStranger, [&] { return come_back_as_others(daemon->instance()); }),
            "is nobody else");
  EXPECT_EQ(daemon->source("/honest:o")["component"]["node"], "honest") << daemon->log();
}

}  // namespace
}  // namespace arbiter::test
