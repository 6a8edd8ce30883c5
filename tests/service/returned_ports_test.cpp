// What ports count for that come back, and what is left of those that do not.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "shm/activity.hpp"
#include "shm/segment.hpp"
#include "tests/client/models.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/raw_port.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::Not;
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
  nlohmann::json status() { return client_.status(); }
  // All output ports, whose activity goes on.
  void close_active() { close_all(shm::kForeverFlag); }
  void close_inactive() { close_all(shm::kNeverActive); }
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (int i = 1; i <= named_; ++i) names.push_back(name(i));
    return names;
  }
  // With the output ports, and the pages of those that it has closed.
  void come_back() {
    come_in(wire::kComesBack | wire::kRejoins,
            {welcome_.descriptors[0].get(), welcome_.descriptors[1].get()});
    for (const wire::Received& opened : left_) {
      auto page = RawClient::message(MessageKind::kHandBackPage);
      page.id = opened.message.id;
      page.value = 1;
      client_.send(page, {opened.descriptors[0].get(), -1});
    }
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
  void close_all(shm::ActivityWord left) {
    for (wire::Received& opened : outputs_) {
      const shm::Mapping page(opened.descriptors[0], sizeof(shm::ActivityPage),
                              shm::Access::kReadWrite);
      page.as<shm::ActivityPage>()->of(opened.message.id).word = left;
      close_raw(client_, opened.message.port);
      left_.push_back(std::move(opened));
    }
    outputs_.clear();
  }
  std::string next_name() { return name(++named_); }
  [[nodiscard]] std::string name(int number) const {
    return "/" + std::to_string(welcome_.message.link) + "/" + std::to_string(number);
  }

  const Daemon& daemon_;
  RawClient client_;
  wire::Received welcome_;
  shm::FileDescriptor output_ = raw_output_segment();
  std::vector<wire::Received> outputs_;
  std::vector<wire::Received> left_;
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

TEST(ReturnedPorts, CountAsTheirUsersThoughOnlyTheirActivityIsLeft) {
  Daemon daemon(kNoRules, {.max_descriptors = 300});
  Owning owning(daemon);
  owning.open_all();
  const std::size_t ports = owning.ports();
  owning.close_active();
  daemon.kill();
  daemon.restart();
  owning.come_back();
  EXPECT_THAT(owning.open_all(), HasSubstr("limit-exceeded"));
  EXPECT_LT(owning.ports(), ports / 2);
}

// As the refusal advises.
TEST(ReturnedPorts, CountNoLongerAsTheirUsersOnceAModelNamesThem) {
  Daemon daemon(kNoRules, {.max_descriptors = 300});
  Owning owning(daemon);
  EXPECT_THAT(owning.open_all(), HasSubstr("limit-exceeded"));
  const std::size_t ports = owning.ports();
  std::string body;
  for (const std::string& name : owning.names()) body += arbiter_at("/in" + name, select(name));
  daemon.write_model(rules(body));
  daemon.hang_up();
  await([&] { return owning.status()["model"]["generation"] == 2; });
  EXPECT_THAT(owning.open_all(), HasSubstr("limit-exceeded"));
  EXPECT_GT(owning.ports(), ports + 3);
}

// The daemon has forgotten the name, and the component has its page yet.
TEST(ReturnedPorts, WithPagesOfNamesThatAreNobodysAreNotRefused) {
  Daemon daemon;
  Owning owning(daemon);
  owning.open_one();
  owning.close_inactive();
  owning.open_one();
  daemon.kill();
  daemon.restart();
  owning.come_back();
  EXPECT_THAT(daemon.log(), Not(HasSubstr("handed back is not the page")));
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
