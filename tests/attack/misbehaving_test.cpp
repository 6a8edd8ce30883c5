// A port whose memory says what no honest one writes is found out, and named: in the status
// document and in the daemon's log.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "tests/attack/prey.hpp"

namespace {

using arbiter::test::Prey;

// What the status says of a connection, once it says anything.
std::string complaint(Prey& prey, const std::string& from, const std::string& to) {
  for (;;) {
    const auto connection = prey.daemon().connection(from, to);
    if (!connection["mismatch"].is_null()) return connection["mismatch"].get<std::string>();
  }
}

TEST(AMisbehavingPublisher, IsNamed) {
  Prey prey;
  prey.activate_attacker();
  const auto& segment = prey.attackers_output;
  segment.channel(0).first = 1;
  segment.channel(0).depth = 4;
  segment.ring(0, prey.link_to_prey)[0] =
      arbiter::shm::make_entry(1, 60'000);  // a slot that does not exist
  segment.channel(0).accepted = 1;
  segment.channel(0).receiver = prey.link_to_prey;
  segment.header().joins = 1;
  EXPECT_FALSE(prey.in().take());
  const std::string why = complaint(prey, "/attacker:o", "/prey:i");
  EXPECT_NE(why.find("the output port misbehaves"), std::string::npos) << why;
  EXPECT_EQ(prey.daemon().input("/prey:i")["misbehaved"], 1);
  EXPECT_NE(prey.daemon().log().find("/attacker:o is not connected to /prey:i: " + why),
            std::string::npos);
  // What it writes now is its own affair.
  segment.ring(0, prey.link_to_prey)[1] = arbiter::shm::make_entry(2, 0);
  EXPECT_FALSE(prey.in().take());
}

TEST(AMisbehavingReceiver, IsNamed) {
  Prey prey;
  // Of whichever number the link between them is.
  for (std::uint64_t number = 0; number < 16; ++number) {
    auto& lane = prey.attackers_input->lanes[number];
    lane.link = number;
    lane.consumed = 1'000'000'000;
    lane.publisher = prey.preys_output;
  }
  EXPECT_EQ(prey.out().publish(1).delivered, 1u);
  const std::string why = complaint(prey, "/prey:o", "/attacker:i");
  EXPECT_NE(why.find("the input port misbehaves"), std::string::npos) << why;
  EXPECT_NE(prey.daemon().log().find("/prey:o is not connected to /attacker:i: " + why),
            std::string::npos);
  // The queue ends when the service thread's word has come to the port.
  while (prey.out().publish(2).delivered != 0) {
  }
}

// By the age of the last sample a motor knows that its commander has fallen silent.
TEST(ASampleFromTheFuture, IsNotNewerThanNow) {
  for (const std::int64_t stamp : {INT64_MAX, INT64_MIN}) {
    Prey prey;
    prey.activate_attacker();
    prey.publish_as_attacker(stamp);
    const auto sample = prey.in().take();
    ASSERT_TRUE(sample);
    const std::int64_t believed = sample->stamp_ns();
    EXPECT_LE(believed, arbiter::shm::monotonic_now());
    EXPECT_GE(believed, 0);
    EXPECT_EQ(sample->stamp_ns(), believed);
  }
}

// It was active until 73 years from now, says a page of T = 500 ms.
TEST(ActivityThatNoArrivalHasMade, DoesNotCommandAfterItsOwner) {
  Prey prey;
  prey.activate_attacker_until(arbiter::shm::kForeverFlag - 1);
  EXPECT_FALSE(prey.in().idle());
  prey.remove_attacker();
  EXPECT_TRUE(prey.in().wait_for(std::chrono::seconds(10)).idle());
  EXPECT_TRUE(prey.in().idle());
  const auto input = prey.daemon().input("/prey:i");
  EXPECT_TRUE(input["idle"]);
  EXPECT_EQ(input["cannot_deliver"]["source"], "/attacker:o");
}

}  // namespace
