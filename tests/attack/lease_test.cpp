// A publisher that holds a lease on its memory: whoever opens it waits for 45 seconds.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <stdexcept>
#include <string>

#include <arbiter/arbiter.hpp>

#include "tests/support/daemon.hpp"
#include "tests/support/raw_port.hpp"

namespace arbiter::test {
namespace {

// The holder of a lease is told by SIGIO that somebody waits.
class IgnoresSigio {
 public:
  IgnoresSigio() : before_(::signal(SIGIO, SIG_IGN)) {}
  IgnoresSigio(const IgnoresSigio&) = delete;
  IgnoresSigio& operator=(const IgnoresSigio&) = delete;
  ~IgnoresSigio() { ::signal(SIGIO, before_); }

 private:
  sighandler_t before_;
};

// Of all that is open of the file, only this may be left.
shm::FileDescriptor leased(shm::FileDescriptor segment) {
  const std::string path = "/proc/self/fd/" + std::to_string(segment.get());
  shm::FileDescriptor only(::open(path.c_str(), O_RDWR | O_CLOEXEC));
  segment.reset();
  if (::fcntl(only.get(), F_SETLEASE, F_WRLCK) != 0) throw std::runtime_error("no lease");
  return only;
}

TEST(ALease, OnASegmentHoldsUpNoReceiver) {
  const IgnoresSigio ignored;
  Daemon daemon(
      "<behaviors><arbiter at='/prey:i'><select from='/attacker:o'/></arbiter></behaviors>");
  Node node("prey");
  auto in = node.input_port("/prey:i");
  RawClient attacker(daemon.instance());
  attacker.hello("attacker");
  const auto segment = leased(raw_output_segment());
  open_raw_output(attacker, "/attacker:o", segment);
  auto out = node.output_port<int>("/prey:o");  // its thread has taken up the attacker by then
  const auto connection = daemon.connection("/attacker:o", "/prey:i");
  ASSERT_TRUE(connection["mismatch"].is_string()) << connection;
  EXPECT_THAT(std::string(connection["mismatch"]), testing::HasSubstr("holds a lease"));
}

}  // namespace
}  // namespace arbiter::test
