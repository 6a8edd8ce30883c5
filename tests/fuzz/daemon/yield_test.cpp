// A port that yields goes where another component asks for its name, and nobody waits for that for
// long. On the fuzz target's stage, where time passes only as the test says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "tests/fuzz/daemon/stage.hpp"

namespace arbiter::fuzz {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using wire::MessageKind;

constexpr shm::Nanoseconds kMillisecond = 1'000'000;

wire::Message message_of(MessageKind kind, const char* name, std::uint32_t flags = 0) {
  wire::Message result;
  result.kind = kind;
  result.value = wire::kWireVersion;
  result.flags = flags;
  result.set_name(name);
  return result;
}

// What a client has been told since it was asked last, of what matters here.
struct Told {
  std::vector<shm::PortInstance> opened;
  std::vector<shm::PortInstance> asked_to_yield;
  std::vector<std::string> refused;
};

class Party {
 public:
  Party(Stage& stage, pid_t pid, const char* name, std::uint32_t flags = 0)
      : stage_(stage), process_(pid, 4'000'000) {
    connection_.emplace(stage.path(), process_);
    stage_.run();
    say(message_of(MessageKind::kHello, name, flags));
  }

  void say(const wire::Message& what) {
    ASSERT_EQ(connection_->send(what), wire::SendResult::kSent);
    stage_.run();
  }
  // Sends it; the daemon has not run yet.
  void begin_to_open(std::uint32_t flags = 0, const char* name = "/shared") {
    ASSERT_EQ(
        connection_->send(message_of(MessageKind::kOpenOutput, name, flags), {segment_.get()}),
        wire::SendResult::kSent);
  }
  void open(std::uint32_t flags = 0, const char* name = "/shared") {
    begin_to_open(flags, name);
    stage_.run();
  }
  void begin_to_close(shm::PortInstance port) {
    wire::Message close = message_of(MessageKind::kClosePort, "");
    close.port = port;
    ASSERT_EQ(connection_->send(close), wire::SendResult::kSent);
  }
  void close(shm::PortInstance port) {
    begin_to_close(port);
    stage_.run();
  }
  void hang_up() {
    connection_.reset();
    stage_.run();
  }
  void die() {
    process_.end();
    hang_up();
  }
  Told hear() {
    Told told;
    wire::Received received;
    while (wire::receive_message(connection_->socket(), received, false) ==
           wire::ReceiveResult::kReceived) {
      const wire::Message& heard = received.message;
      if (heard.kind == MessageKind::kOpened) told.opened.push_back(heard.port);
      if (heard.kind == MessageKind::kYield) told.asked_to_yield.push_back(heard.port);
      if (heard.kind == MessageKind::kRefused) told.refused.emplace_back(heard.text_view());
    }
    return told;
  }
  // The port that it has been given just now.
  shm::PortInstance opened() {
    const Told told = hear();
    EXPECT_EQ(told.opened.size(), 1U);
    EXPECT_THAT(told.refused, IsEmpty());
    return told.opened.empty() ? 0 : told.opened[0];
  }

 private:
  Stage& stage_;
  const shm::FileDescriptor segment_ = make_output_segment({}, 1);
  Process process_;
  std::optional<Connection> connection_;
};

class AYieldingPort : public testing::Test {
 protected:
  // One that yields has the name.
  AYieldingPort() {
    holder_.open(wire::kYields);
    port_ = holder_.opened();
  }

  Stage stage_;
  Party holder_{stage_, 1 << 23, "holder"};
  Party newcomer_{stage_, (1 << 23) + 1, "newcomer"};
  shm::PortInstance port_ = 0;
};

TEST_F(AYieldingPort, IsAskedToGoAndTheOtherHasTheNameOnceItHas) {
  newcomer_.open();
  EXPECT_THAT(holder_.hear().asked_to_yield, ElementsAre(port_));
  const Told before = newcomer_.hear();
  EXPECT_THAT(before.opened, IsEmpty());
  EXPECT_THAT(before.refused, IsEmpty());
  holder_.close(port_);
  EXPECT_NE(newcomer_.opened(), 0U) << "no time has passed";
}

TEST_F(AYieldingPort, ThatNeverGoesIsWaitedForAndKeepsItsNameThen) {
  newcomer_.open();
  stage_.run(199 * kMillisecond);
  EXPECT_THAT(newcomer_.hear().refused, IsEmpty());
  stage_.run(2 * kMillisecond);
  EXPECT_THAT(newcomer_.hear().refused,
              ElementsAre("the output port /shared is held by node \"holder\" (pid 8388608)"));
  EXPECT_THAT(holder_.hear().refused, IsEmpty());
  holder_.close(port_);  // late
  EXPECT_THAT(newcomer_.hear().opened, IsEmpty());
  newcomer_.open();
  newcomer_.opened();
}

TEST_F(AYieldingPort, IsAskedOnceHoweverManyAskFor) {
  Party another(stage_, (1 << 23) + 2, "another");
  for (int i = 0; i < 3; ++i) {
    newcomer_.open();
    another.open();
  }
  EXPECT_THAT(holder_.hear().asked_to_yield, ElementsAre(port_));
  holder_.close(port_);
  const Told of_one = newcomer_.hear();
  const Told of_other = another.hear();
  EXPECT_EQ(of_one.opened.size() + of_other.opened.size(), 1U);
  EXPECT_EQ(of_one.refused.size() + of_other.refused.size(), 5U);
}

TEST_F(AYieldingPort, DoesNotYieldToAnotherThatYields) {
  newcomer_.open(wire::kYields);
  EXPECT_THAT(newcomer_.hear().refused, ElementsAre(HasSubstr("is held by node \"holder\"")));
  EXPECT_THAT(holder_.hear().asked_to_yield, IsEmpty());
}

TEST_F(AYieldingPort, DoesNotYieldToItsOwnNode) {
  holder_.open();
  const Told told = holder_.hear();
  EXPECT_THAT(told.refused, ElementsAre(HasSubstr("is held by node \"holder\"")));
  EXPECT_THAT(told.asked_to_yield, IsEmpty());
}

// It asks before whoever waits is served: nobody gets the name but who was promised it.
TEST_F(AYieldingPort, ThatGoesAndComesBackAtOnceDoesNotGetTheNameAgain) {
  newcomer_.open();
  holder_.hear();
  holder_.begin_to_close(port_);
  holder_.open(wire::kYields);
  EXPECT_THAT(holder_.hear().refused, ElementsAre(HasSubstr("yields to a component")));
  const shm::PortInstance of_newcomer = newcomer_.opened();
  holder_.open(wire::kYields);
  EXPECT_THAT(holder_.hear().refused, ElementsAre(HasSubstr("is held by node \"newcomer\"")));
  newcomer_.close(of_newcomer);
  holder_.open(wire::kYields);
  EXPECT_NE(holder_.opened(), 0U) << "nobody waits any more";
}

TEST_F(AYieldingPort, ThatDiesIsYieldedByThat) {
  newcomer_.open();
  holder_.die();
  EXPECT_NE(newcomer_.opened(), 0U);
}

TEST_F(AYieldingPort, HasTheNameAgainWhereWhoAskedForItHasGone) {
  const std::size_t before = count_descriptors();
  {
    Party brief(stage_, (1 << 23) + 3, "brief");
    brief.open();
    EXPECT_THAT(holder_.hear().asked_to_yield, ElementsAre(port_));
    brief.die();
  }
  holder_.close(port_);
  stage_.run(250 * kMillisecond);
  holder_.open(wire::kYields);
  holder_.opened();
  stage_.run(1000 * kMillisecond);
  EXPECT_EQ(count_descriptors(), before);
}

TEST_F(AYieldingPort, MakesNobodyWaitWhoHasTooManyRequestsWaiting) {
  for (std::uint32_t i = 0; i < shm::kMaxPostponed; ++i) newcomer_.open();
  EXPECT_THAT(newcomer_.hear().refused, IsEmpty());
  newcomer_.open();
  EXPECT_THAT(newcomer_.hear().refused, ElementsAre(HasSubstr("kMaxPostponed")));
  holder_.close(port_);
  EXPECT_EQ(newcomer_.hear().opened.size(), 1U);
}

TEST(APortThatDoesNotYield, KeepsItsNameAndIsNotAsked) {
  Stage stage;
  Party holder(stage, 1 << 23, "holder");
  Party newcomer(stage, (1 << 23) + 1, "newcomer");
  holder.open();
  holder.opened();
  newcomer.open();
  EXPECT_THAT(newcomer.hear().refused, ElementsAre(HasSubstr("is held by node \"holder\"")));
  EXPECT_THAT(holder.hear().asked_to_yield, IsEmpty());
}

}  // namespace
}  // namespace arbiter::fuzz
