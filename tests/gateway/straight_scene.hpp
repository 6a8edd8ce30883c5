// A gateway for navigation and teleoperation, which command a base: its threads, its loop and what
// it sends are the test's own.
#pragma once

#include <gmock/gmock.h>
#include <poll.h>

#include <string>

#include <arbiter/arbiter.hpp>

#include "gateway/core/incoming.hpp"
#include "gateway/core/outgoing.hpp"
#include "shm/clock.hpp"
#include "tests/gateway/foreign.hpp"
#include "tests/gateway/mapping_text.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::gateway {

// Navigation and teleoperation come from outside. A component of this host overrides both.
inline constexpr const char* kStraightModel =
    "<behaviors timeout='1000s'>"
    "<behavior name='Navigate'><config at='/Base/cmd:i'>/Nav/cmd:o</config></behavior>"
    "<behavior name='Teleoperate'><config at='/Base/cmd:i'>/Teleop/cmd:o</config>"
    "<inhibition>Navigate</inhibition></behavior>"
    "<behavior name='Stop'><config at='/Base/cmd:i'>/Stop/cmd:o</config>"
    "<inhibition>Navigate</inhibition><inhibition>Teleoperate</inhibition></behavior>"
    "</behaviors>";

class Straight : public testing::Test {
 protected:
  explicit Straight(const std::string& model = kStraightModel, const std::string& idle = "")
      : daemon_(model),
        read_(read_dds("<in topic='/nav' type='a/msg/B' port='/Nav/cmd:o' max_size='64'/>"
                       "<in topic='/teleop' type='a/msg/B' port='/Teleop/cmd:o' max_size='64'/>"
                       "<out port='/Base/cmd:i' topic='/cmd' type='a/msg/B' " +
                       idle + "/>")) {
    feeds_.emplace("/Nav/cmd:o", &nav_.feed());
    feeds_.emplace("/Teleop/cmd:o", &teleop_.feed());
    outgoing_.lead(feeds_, [this] { ++calls_; });
    outgoing_.run(shm::monotonic_now());
  }

  Incoming::Fate deliver(Incoming& in, const std::string& bytes) {
    return in.deliver(BytesSample(bytes), Time::max());
  }
  [[nodiscard]] bool calls_loop() const {
    pollfd polled{descriptor_, POLLIN, 0};
    return ::poll(&polled, 1, 0) == 1;
  }
  OutputPort<void> stop() {
    return node_.output_port("/Stop/cmd:o", Type::variable("a/msg/B", 64));
  }
  static void publish(OutputPort<void>& port, const std::string& bytes) {
    port.publish(Bytes(reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()));
  }
  // The loop, where it is called.
  void run() {
    if (calls_loop() || outgoing_.next() == 0) outgoing_.run(shm::monotonic_now());
  }
  // From now on navigation's samples go straight on.
  void lead_navigation() {
    deliver(nav_, "first");
    run();
    ASSERT_THAT(sender_.sent, testing::ElementsAre("first"));
    sender_.sent.clear();
  }

  test::Daemon daemon_;
  Read read_;
  Account nav_account_{"nav", "publisher"};
  Account teleop_account_{"teleop", "publisher"};
  Account account_{"cmd", "subscriber"};
  KeepingSender sender_;
  OneAge ages_;
  FeedBySource feeds_;
  int calls_ = 0;
  Node node_{"gateway"};
  Incoming nav_{node_, read_.entry(0), nav_account_};
  Incoming teleop_{node_, read_.entry(1), teleop_account_};
  Outgoing outgoing_{node_, read_.entry(2), sender_, account_, ages_};
  const int descriptor_ = outgoing_.descriptor();
};

}  // namespace arbiter::gateway
