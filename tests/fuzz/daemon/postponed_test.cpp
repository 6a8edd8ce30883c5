// Requests that wait are bounded, each client's for itself. On the fuzz target's stage, where no
// time passes meanwhile.
#include <gtest/gtest.h>

#include "tests/fuzz/daemon/stage.hpp"

namespace arbiter::fuzz {
namespace {

using wire::MessageKind;

wire::Message message(MessageKind kind, const char* name) {
  wire::Message result;
  result.kind = kind;
  result.value = wire::kWireVersion;
  result.set_name(name);
  return result;
}

struct Answers {
  int over_the_limit = 0;
  int refused = 0;
};

Answers read(const Connection& connection) {
  Answers answers;
  wire::Received received;
  while (wire::receive_message(connection.socket(), received, false) ==
         wire::ReceiveResult::kReceived) {
    if (received.message.kind != MessageKind::kRefused) continue;
    const bool names_it =
        received.message.text_view().find("kMaxPostponed") != std::string_view::npos;
    ++(names_it ? answers.over_the_limit : answers.refused);
  }
  return answers;
}

class Postponed : public testing::Test {
 protected:
  // A port whose process lives and does not answer: its name is kept for a while.
  Postponed() {
    auto hello = message(MessageKind::kHello, "away");
    hello.flags = wire::kComesBack;
    Connection connection(stage_.path(), away_);
    stage_.run();
    connection.send(hello);
    connection.send(message(MessageKind::kOpenOutput, "/kept"), {segment_.get()});
    stage_.run();
  }

  void ask(const Connection& connection, std::uint32_t times) {
    for (std::uint32_t i = 0; i < times; ++i) {
      ASSERT_EQ(connection.send(message(MessageKind::kOpenOutput, "/kept"), {segment_.get()}),
                wire::SendResult::kSent);
      stage_.run();
    }
  }

  const shm::FileDescriptor segment_ = make_output_segment({}, 1);
  Process away_{1 << 23, 4'000'000};
  Process asking_{(1 << 23) + 1, 4'000'000};
  Stage stage_;
};

TEST_F(Postponed, RequestsAreBoundedAndTheRestIsRefusedAtOnce) {
  const Connection connection(stage_.path(), asking_);
  stage_.run();
  connection.send(message(MessageKind::kHello, "asking"));
  stage_.run();
  for (int round = 0; round < 2; ++round) {
    const std::size_t before = count_descriptors();
    ask(connection, shm::kMaxPostponed);
    EXPECT_EQ(count_descriptors(), before + shm::kMaxPostponed);
    ask(connection, 10);
    EXPECT_EQ(count_descriptors(), before + shm::kMaxPostponed);
    EXPECT_EQ(read(connection).over_the_limit, 10);
    stage_.run(1'000'000'000);
    const Answers later = read(connection);
    EXPECT_EQ(later.over_the_limit, 0);
    EXPECT_EQ(later.refused, shm::kMaxPostponed);
    EXPECT_EQ(count_descriptors(), before);
  }
}

}  // namespace
}  // namespace arbiter::fuzz
