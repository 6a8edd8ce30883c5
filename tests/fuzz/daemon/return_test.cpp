// Components that the daemon has lost come back one message after the other, and others in between:
// their links stand as they were. On the fuzz target's stage, where a test says who is served when.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/fuzz/daemon/stage.hpp"

namespace arbiter::fuzz {
namespace {

using wire::MessageKind;

// A component with one port, at /a or at /b, and the link between them.
class Component {
 public:
  Component(Stage& stage, MessageKind opens, const char* name)
      : stage_(stage), process_(1 << 23, 4'000'000), opens_(opens) {
    port_.set_name(name);
    connect();
    say(hello());
    port_.kind = opens;
    say(port_, {segment_.get(), bell_.write_end().get()});
    port_.port = find(MessageKind::kOpened).message.port;
    if (is_output()) page_ = std::move(find(MessageKind::kOpened).descriptors[0]);
    port_.id = find(MessageKind::kOpened).message.id;
    node_ = find(MessageKind::kWelcome).message.link;
    board_ = std::move(find(MessageKind::kWelcome).descriptors[0]);
    registry_ = std::move(find(MessageKind::kWelcome).descriptors[1]);
  }

  // The daemon loses it, but it lives.
  void hang_up() {
    connection_.reset();
    stage_.run();
    heard_.clear();
  }
  void connect() {
    connection_ = std::make_unique<Connection>(stage_.path(), process_);
    stage_.run();
  }
  void hand_back_port() {
    wire::Message message = hello();
    message.flags |= wire::kRejoins;
    message.link = node_;
    say(message, {board_.get(), registry_.get()});
    message = port_;
    message.kind = is_output() ? MessageKind::kHandBackOutput : MessageKind::kHandBackInput;
    say(message, {segment_.get(), is_output() ? page_.get() : bell_.write_end().get()});
  }
  void hand_back_link(shm::PortInstance peer, std::uint64_t number) {
    wire::Message message;
    message.kind = MessageKind::kHandBackLink;
    message.port = port_.port;
    message.peer = peer;
    message.link = number;
    say(message);
    message = {};
    message.kind = MessageKind::kHandedBack;
    say(message);
  }

  void close() {
    wire::Message message;
    message.kind = MessageKind::kClosePort;
    message.port = port_.port;
    say(message);
  }

  const wire::Received& peer() {
    return find(is_output() ? MessageKind::kInputPeer : MessageKind::kOutputPeer);
  }
  bool has_heard(MessageKind kind) {
    read();
    return std::any_of(heard_.begin(), heard_.end(),
                       [&](const auto& each) { return each.message.kind == kind; });
  }
  [[nodiscard]] shm::PortInstance port() const { return port_.port; }

 private:
  [[nodiscard]] bool is_output() const { return opens_ == MessageKind::kOpenOutput; }
  static wire::Message hello() {
    wire::Message message;
    message.kind = MessageKind::kHello;
    message.flags = wire::kComesBack;
    message.value = wire::kWireVersion;
    message.set_name("component");
    return message;
  }
  void say(const wire::Message& message, std::vector<int> descriptors = {}) {
    if (message.kind == MessageKind::kOpenOutput) descriptors.resize(1);
    ASSERT_EQ(connection_->send(message, std::move(descriptors)), wire::SendResult::kSent);
    stage_.run();
  }
  void read() {
    wire::Received received;
    while (wire::receive_message(connection_->socket(), received, false) ==
           wire::ReceiveResult::kReceived) {
      heard_.push_back(std::move(received));
    }
  }
  wire::Received& find(MessageKind kind) {
    read();
    for (auto& each : heard_) {
      if (each.message.kind == kind) return each;
    }
    throw std::runtime_error("it was not told");
  }

  Stage& stage_;
  Process process_;
  const MessageKind opens_;
  const shm::Bell bell_;
  const shm::FileDescriptor segment_ =
      opens_ == MessageKind::kOpenOutput ? make_output_segment({}, 1) : make_input_segment(1);
  std::unique_ptr<Connection> connection_;
  wire::Message port_;
  std::uint64_t node_ = 0;
  shm::FileDescriptor board_;
  shm::FileDescriptor registry_;
  shm::FileDescriptor page_;
  std::vector<wire::Received> heard_;
};

class Return : public testing::Test {
 protected:
  Return() : number_(input_.peer().message.link) {
    EXPECT_NE(number_, 0u);
    EXPECT_EQ(output_.peer().message.link, number_);
    for (Component* each : {&output_, &input_}) {
      each->hang_up();
      each->connect();
    }
  }

  void expect_the_link_stands() {
    for (Component* each : {&output_, &input_}) {
      EXPECT_FALSE(each->has_heard(MessageKind::kRefused));
      EXPECT_FALSE(each->has_heard(MessageKind::kDisconnected));
      EXPECT_FALSE(each->has_heard(MessageKind::kPeerGone));
      EXPECT_FALSE(each->has_heard(MessageKind::kOutputPeer));
      EXPECT_FALSE(each->has_heard(MessageKind::kInputPeer));
    }
  }

  Stage stage_;
  Component output_{stage_, MessageKind::kOpenOutput, "/a"};
  Component input_{stage_, MessageKind::kOpenInput, "/b"};
  const std::uint64_t number_;
};

TEST_F(Return, OfAReceiverWhileItsPublisherIsStillSpeaking) {
  output_.hand_back_port();
  input_.hand_back_port();
  input_.hand_back_link(output_.port(), number_);
  output_.hand_back_link(input_.port(), number_);
  expect_the_link_stands();
}

TEST_F(Return, OfAPublisherWhileItsReceiverIsStillSpeaking) {
  input_.hand_back_port();
  output_.hand_back_port();
  output_.hand_back_link(input_.port(), number_);
  input_.hand_back_link(output_.port(), number_);
  expect_the_link_stands();
}

TEST_F(Return, WhileAnotherModelComesIntoForce) {
  output_.hand_back_port();
  input_.hand_back_port();
  stage_.reload();
  input_.hand_back_link(output_.port(), number_);
  stage_.reload();
  output_.hand_back_link(input_.port(), number_);
  expect_the_link_stands();
}

TEST_F(Return, OfOneWhosePeerGoesWhileItIsStillSpeaking) {
  output_.hand_back_port();
  input_.hand_back_port();
  input_.hand_back_link(output_.port(), number_);
  EXPECT_FALSE(input_.has_heard(MessageKind::kPeerGone));
  output_.close();
  EXPECT_TRUE(input_.has_heard(MessageKind::kPeerGone));
}

}  // namespace
}  // namespace arbiter::fuzz
