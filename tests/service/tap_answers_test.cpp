// A publisher that answers what it was not asked: of the taps on it, and of how much memory it
// uses, the daemon tells others no more than once.
#include <gtest/gtest.h>

#include "shm/bell.hpp"
#include "shm/event_segment.hpp"
#include "tests/client/models.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/raw_port.hpp"

namespace arbiter::test {
namespace {

using wire::MessageKind;

constexpr int kTimes = 10;

shm::FileDescriptor raw_event_segment() {
  auto segment = shm::make_segment("test", sizeof(shm::EventSegment));
  if (shm::allocate(segment, 0, sizeof(shm::EventSegment))) throw std::runtime_error("no memory");
  shm::seal(segment, shm::Seals::kOneWriter);
  return segment;
}

// How many of a kind come to a client before the daemon answers its next question.
int count_until_now(RawClient& client, MessageKind kind) {
  client.send(RawClient::message(MessageKind::kStatus));
  int count = 0;
  wire::Received received;
  while (client.receive(received) && received.message.kind != MessageKind::kStatusReply) {
    count += received.message.kind == kind ? 1 : 0;
  }
  return count;
}

class TapAnswers : public testing::Test {
 protected:
  TapAnswers() {
    publisher_.hello("publisher");
    port_ = open_raw_output(publisher_, "/out", segment_).message.port;
  }

  void answer(shm::PortInstance tap, int times) {
    auto message = RawClient::message(MessageKind::kTapped);
    message.port = port_;
    message.peer = tap;
    for (int i = 0; i < times; ++i) publisher_.send(message, {events_.get(), -1});
    static_cast<void>(publisher_.status());  // the daemon has heard it all
  }

  Daemon daemon_{single_model()};
  RawClient publisher_{daemon_.instance()};
  const shm::FileDescriptor segment_ = raw_output_segment();
  const shm::FileDescriptor events_ = raw_event_segment();
  shm::PortInstance port_ = 0;
};

TEST_F(TapAnswers, ThatNobodyHasAskedForTellReceiversNothing) {
  RawClient receiver(daemon_.instance());
  receiver.hello("receiver");
  const auto input = raw_input_segment();
  const shm::Bell bell;
  receiver.send(RawClient::message(MessageKind::kOpenInput, "/in"),
                {input.get(), bell.write_end().get()});
  receiver.expect(MessageKind::kOutputPeer);
  static_cast<void>(publisher_.status());
  count_until_now(receiver, MessageKind::kOutputGrown);  // of the introduction
  answer(424242, kTimes);
  EXPECT_EQ(count_until_now(receiver, MessageKind::kOutputGrown), 0);
}

TEST_F(TapAnswers, ThatAreRepeatedReachTheTapOnce) {
  RawClient tapper(daemon_.instance());
  tapper.hello("tapper");
  const auto tap = raw_tap_segment();
  const shm::Bell bell;
  tapper.send(RawClient::message(MessageKind::kOpenTap, "/out"),
              {tap.get(), bell.for_publishers().get()});
  const auto asked = publisher_.expect(MessageKind::kTap).message.peer;
  answer(asked, kTimes);
  EXPECT_EQ(count_until_now(tapper, MessageKind::kTapSource), 1);
  auto refusal = RawClient::message(MessageKind::kPeerRefused);
  refusal.port = port_;
  refusal.peer = asked;
  for (int i = 0; i < kTimes; ++i) publisher_.send(refusal);
  static_cast<void>(publisher_.status());
  EXPECT_EQ(count_until_now(tapper, MessageKind::kConnectionRefused), 0);
}

}  // namespace
}  // namespace arbiter::test
