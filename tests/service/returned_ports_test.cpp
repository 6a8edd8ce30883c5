// What ports count for that come back, and what is left of those that do not.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/client/models.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/raw_port.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using wire::MessageKind;

// A component with many ports, of which none is ever closed, and which comes back.
class Owning {
 public:
  explicit Owning(const Daemon& daemon) : daemon_(daemon), client_(daemon.instance()) {
    welcome_ = come_in(wire::kComesBack, {-1, -1});
  }

  [[nodiscard]] std::size_t ports() const { return outputs_.size(); }
  void open_one() { outputs_.push_back(open_raw_output(client_, next_name(), output_)); }
  // Until no more are given: why.
  std::string open_all() {
    try {
      for (;;) open_one();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }
  // Throws where one is refused.
  void open_inputs(int count) {
    int bell[2];
    ASSERT_EQ(::pipe2(bell, O_CLOEXEC), 0);
    const shm::FileDescriptor read(bell[0]);
    const shm::FileDescriptor written(bell[1]);
    const auto segment = raw_input_segment();
    for (int i = 0; i < count; ++i) {
      client_.send(RawClient::message(MessageKind::kOpenInput, next_name()),
                   {segment.get(), written.get()});
      client_.expect(MessageKind::kConnected);
    }
  }
  void hang_up() { client_.hang_up(); }
  // With the output ports.
  void come_back() {
    come_in(wire::kComesBack | wire::kRejoins,
            {welcome_.descriptors[0].get(), welcome_.descriptors[1].get()});
    for (const wire::Received& opened : outputs_) {
      auto output = RawClient::message(MessageKind::kHandBackOutput);
      output.port = opened.message.port;
      output.id = opened.message.id;
      client_.send(output, {output_.get(), opened.descriptors[0].get()});
    }
    client_.send(RawClient::message(MessageKind::kHandedBack));
    client_.status();
  }

 private:
  // Again and again, as the library does: what the last conversation took may not be free yet.
  wire::Received come_in(std::uint32_t flags, RawClient::Descriptors memory) {
    auto hello = RawClient::hello_message("owning", flags);
    hello.link = welcome_.message.link;
    wire::Received welcome;
    await([&] {
      client_ = RawClient(daemon_.instance());
      client_.send(hello, memory);
      return client_.receive(welcome) && welcome.message.kind == MessageKind::kWelcome;
    });
    return welcome;
  }
  std::string next_name() {
    return "/" + std::to_string(welcome_.message.link) + "/" + std::to_string(++named_);
  }

  const Daemon& daemon_;
  RawClient client_;
  wire::Received welcome_;
  shm::FileDescriptor output_ = raw_output_segment();
  std::vector<wire::Received> outputs_;
  int named_ = 0;
};

TEST(ReturnedPorts, CountAsTheirUsers) {
  Daemon daemon(kNoRules, {.max_descriptors = 300});
  Owning owning(daemon);
  EXPECT_THAT(owning.open_all(), HasSubstr("limit-exceeded"));
  const std::size_t ports = owning.ports();
  ASSERT_GT(ports, 10u);
  owning.hang_up();
  owning.come_back();
  EXPECT_THAT(owning.open_all(), HasSubstr("limit-exceeded"));
  EXPECT_EQ(owning.ports(), ports);
}

// Or they would not be told from what others may take meanwhile.
TEST(ReturnedPorts, CountAsTheirUsersWhileTheyAreAway) {
  Daemon daemon(kNoRules, {.max_descriptors = 300});
  Owning owning(daemon);
  owning.open_all();
  owning.hang_up();
  {
    Owning second(daemon);
    EXPECT_THAT(second.open_all(), HasSubstr("limit-exceeded"));
    EXPECT_LT(second.ports(), 3u);
  }
  owning.come_back();
}

TEST(ReturnedPorts, CountAsTheirUsersUnderAnotherDaemon) {
  Daemon daemon(kNoRules, {.max_descriptors = 300});
  Owning owning(daemon);
  owning.open_all();
  const std::size_t ports = owning.ports();
  for (int round = 0; round < 2; ++round) {
    daemon.kill();
    daemon.restart();
    owning.come_back();
    EXPECT_THAT(owning.open_all(), HasSubstr("limit-exceeded"));
    EXPECT_EQ(owning.ports(), ports);
  }
}

// A name that only a daemon before the last has known is nobody's.
TEST(ReturnedPorts, LeaveNoNamesOfThoseThatDoNotComeBack) {
  Daemon daemon;
  Owning owning(daemon);
  for (int round = 0; round < 2; ++round) {
    owning.open_inputs(1500);  // of 4096
    daemon.kill();
    daemon.restart();
    owning.come_back();
  }
}

// Its links are those of the model that comes, too.
TEST(ReturnedPorts, LeaveTheLinksThatWereMadeAhead) {
  Daemon daemon(only("a"));
  RawClient publisher(daemon.instance());
  publisher.hello("publisher", wire::kHasServiceThread);
  const auto segment = raw_output_segment();
  open_raw_output(publisher, "/b", segment);
  RawClient receiver(daemon.instance());
  receiver.hello("receiver", wire::kHasServiceThread);  // and answers nothing: the model waits
  int bell[2];
  ASSERT_EQ(::pipe2(bell, O_CLOEXEC), 0);
  const shm::FileDescriptor read(bell[0]);
  const shm::FileDescriptor written(bell[1]);
  const auto input = raw_input_segment();
  receiver.send(RawClient::message(MessageKind::kOpenInput, "/in"), {input.get(), written.get()});
  receiver.expect(MessageKind::kConnected);
  Owning owning(daemon);
  owning.open_one();
  daemon.write_model(only("b"));
  daemon.hang_up();
  publisher.expect(MessageKind::kInputPeer);
  owning.hang_up();
  owning.come_back();
  publisher.send(RawClient::message(MessageKind::kStatus));
  wire::Received heard;
  while (publisher.receive(heard) && heard.message.kind != MessageKind::kStatusReply) {
    EXPECT_NE(heard.message.kind, MessageKind::kDisconnected);
  }
}

}  // namespace
}  // namespace arbiter::test
