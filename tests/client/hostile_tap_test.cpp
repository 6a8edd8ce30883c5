// A tap whose memory lies to publishers, and taps of several users.
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <random>
#include <string>

#include <arbiter/arbiter.hpp>

#include "client/output/events.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/raw_port.hpp"
#include "tests/support/written.hpp"

namespace arbiter::test {
namespace {

Written<shm::TapSegment> tap_segment(std::uint32_t max_held) {
  Written<shm::TapSegment> segment;
  segment->magic = shm::TapSegment::kMagic;
  segment->version = shm::TapSegment::kVersion;
  segment->max_held = max_held;
  segment->sleeps = 1;
  shm::seal(segment.descriptor, shm::Seals::kOneWriter);
  return segment;
}

TEST(AHostileTap, HoldsUpNobodyAndTakesNoSlotThatIsNotItsOwn) {
  Daemon daemon(single_model());
  Node node("test");
  OutputPortOptions options;
  options.max_memory = 64 * 8;  // two loans, a copy; 5 for the receiver
  auto out = node.output_port<Number>("/out", options);
  auto in = node.input_port<Number>("/in", {.depth = 4, .max_held = 1});
  RawClient client(daemon.instance());
  client.hello("hostile");
  const auto segment = tap_segment(shm::kMaxTapHeld);
  const shm::Bell bell;
  client.send(RawClient::message(wire::MessageKind::kOpenTap, "/out"),
              {segment.descriptor.get(), bell.for_publishers().get()});
  const auto publisher = client.expect(wire::MessageKind::kTapSource).message.peer;
  std::mt19937_64 random(7);
  for (std::int64_t i = 0; i < 20'000; ++i) {
    for (auto& hold : segment->holds) {
      const auto slot = static_cast<std::uint32_t>(random() % 256);
      hold.store(random() % 8 == 0 ? random() : shm::make_hold(publisher, slot));
    }
    segment->wait.store(random());
    segment->max_held = static_cast<std::uint32_t>(random());
    ASSERT_EQ(out.publish(Number{i}).delivered, 1u);
    ASSERT_EQ(take_from(in), i);
  }
  EXPECT_EQ(daemon.source("/out")["no_slot"], 0);
}

TEST(AHostileTap, WhoseSegmentIsNoneIsRefused) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  const shm::Bell bell;
  const auto refusal = [&](const shm::FileDescriptor& segment) {
    RawClient client(daemon.instance());
    client.hello("hostile");
    client.send(RawClient::message(wire::MessageKind::kOpenTap, "/out"),
                {segment.get(), bell.for_publishers().get()});
    return error_of([&] { client.expect(wire::MessageKind::kOpened); });
  };
  EXPECT_NE(refusal(raw_input_segment()).find("not a tap's of this version"), std::string::npos);
  const Written<shm::TapSegment> unsealed;
  EXPECT_NE(refusal(unsealed.descriptor), "no error");
  // What the daemon does not look into, the publisher does.
  for (const std::uint32_t max_held : {shm::kMaxTapHeld + 1, UINT32_MAX}) {
    RawClient client(daemon.instance());
    client.hello("hostile");
    const auto segment = tap_segment(max_held);
    client.send(RawClient::message(wire::MessageKind::kOpenTap, "/out"),
                {segment.descriptor.get(), bell.for_publishers().get()});
    const auto refused = client.expect(wire::MessageKind::kConnectionRefused);
    EXPECT_EQ(refused.message.text_view(), "the tap's segment is not one of this version");
  }
}

std::shared_ptr<const detail::TapPeer> tap_of(shm::PortInstance number, uid_t user,
                                              std::uint32_t max_held, bool is_privileged = false) {
  auto peer = std::make_shared<detail::TapPeer>();
  peer->instance = number;
  peer->identity.inode = number;
  peer->user = user;
  peer->is_privileged = is_privileged;
  peer->max_held = max_held;
  return peer;
}

// How many taps a user gets, each of which may hold so much.
int taps_for(detail::TapSeats& seats, uid_t user, std::uint32_t max_held,
             bool is_privileged = false) {
  static shm::PortInstance last = 0;
  int count = 0;
  while (error_of([&] {
           seats.add(tap_of(++last, user, max_held, is_privileged), "/out", 128,
                     shm::Residence::kMapped);
         }) == "no error") {
    ++count;
  }
  return count;
}

TEST(TapsOfSeveralUsers, LeaveSomethingForEachOther) {
  detail::TapSeats seats;
  EXPECT_EQ(taps_for(seats, 1001, 0), 7) << "two of sixteen are kept, and half of the rest";
  EXPECT_EQ(taps_for(seats, 1002, 0), 3);
  EXPECT_EQ(taps_for(seats, 1003, 0), 2);
  EXPECT_EQ(taps_for(seats, 1004, 0), 1);
  EXPECT_EQ(taps_for(seats, 0, 0, true), 3) << "all that are left";
  EXPECT_EQ(taps_for(seats, 1005, 0), 0);
}

TEST(TapsOfSeveralUsers, ShareWhatMayBeHeld) {
  detail::TapSeats seats;
  EXPECT_EQ(taps_for(seats, 1001, 14), 2) << "28 of 64, of which eight are kept";
  EXPECT_EQ(taps_for(seats, 1002, 14), 1);
  EXPECT_EQ(taps_for(seats, 0, 14, true), 1);
}

TEST(TapsOfSeveralUsers, SayWhoseShareIsUsedUp) {
  detail::TapSeats seats;
  EXPECT_EQ(taps_for(seats, 1001, 0), 7);
  EXPECT_EQ(error_of([&] { seats.add(tap_of(99, 1001, 0), "/out", 128, shm::Residence::kMapped); }),
            "/out has 7 taps already, of 16 (kMaxTaps); user 1001 has 7 of them, and may have no "
            "more than is left for others");
}

}  // namespace
}  // namespace arbiter::test
