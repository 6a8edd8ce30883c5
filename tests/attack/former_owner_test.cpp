// A user who had a source open has kept its activity page mapped, writable. Once the source is
// another user's, nothing that he writes there counts.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <functional>
#include <optional>

#include <arbiter/arbiter.hpp>

#include "shm/activity.hpp"
#include "shm/clock.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/other_user.hpp"
#include "tests/support/raw_port.hpp"

namespace arbiter::test {
namespace {

using wire::MessageKind;

constexpr const char* kModel =
    "<behaviors timeout='forever'>"
    "<arbiter at='/motor:i'><select from='/drive:o'>not /estop:o</select></arbiter>"
    "</behaviors>";

// Opens /estop:o as a stranger, and does what it is told.
class FormerOwner {
 public:
  explicit FormerOwner(const std::string& instance) {
    child_ = ::fork();
    if (child_ < 0) throw std::runtime_error("fork");
    if (child_ == 0) ::_exit(run(instance));
    orders_.close(0);
    answers_.close(1);
    if (answer() != '+') throw std::runtime_error("the stranger could not open the port");
  }
  FormerOwner(const FormerOwner&) = delete;
  FormerOwner& operator=(const FormerOwner&) = delete;
  ~FormerOwner() {
    orders_.close(1);
    int status = 0;
    ::waitpid(child_, &status, 0);
  }

  // 's': is active; 'd': deactivates; 'c': closes the port; 'h': hands its page back to the daemon,
  // '+' if that was refused.
  char tell(char order) {
    if (::write(orders_.ends[1], &order, 1) != 1) throw std::runtime_error("the stranger has died");
    return answer();
  }

 private:
  char answer() {
    char byte = 0;
    return ::read(answers_.ends[0], &byte, 1) == 1 ? byte : '\0';
  }

  int run(const std::string& instance) {
    orders_.close(1);
    answers_.close(0);
    try {
      if (!become(kStranger)) return 2;
      RawClient client(instance);
      const wire::Received welcome = client.hello("former");
      const auto segment = raw_output_segment();
      const wire::Received opened = open_raw_output(client, "/estop:o", segment);
      const shm::Mapping page(opened.descriptors[0], sizeof(shm::ActivityPage),
                              shm::Access::kReadWrite);
      shm::Activity& activity = page.as<shm::ActivityPage>()->of(opened.message.id);
      char order = '+';
      do {
        char said = '+';
        if (order == 's') activity.word = shm::arrival(shm::monotonic_now(), shm::kForever);
        if (order == 'd') activity.word = shm::deactivation(shm::monotonic_now());
        if (order == 'c') {
          close_raw(client, opened.message.port);
          client.status();  // by now it is closed
        }
        if (order == 'h') said = hand_back(instance, welcome, opened) ? '-' : '+';
        if (::write(answers_.ends[1], &said, 1) != 1) return 3;
      } while (::read(orders_.ends[0], &order, 1) == 1);
    } catch (const std::exception&) {
      return 1;
    }
    return 0;
  }

  static bool hand_back(const std::string& instance, const wire::Received& welcome,
                        const wire::Received& opened) {
    RawClient back(instance);
    auto hello = RawClient::hello_message("former", wire::kRejoins);
    hello.link = welcome.message.link;
    back.send(hello, {welcome.descriptors[0].get(), welcome.descriptors[1].get()});
    back.expect(MessageKind::kWelcome);
    auto page = RawClient::message(MessageKind::kHandBackPage);
    page.id = opened.message.id;
    page.value = 1;
    back.send(page, {opened.descriptors[0].get(), -1});
    return back.expect_refusal().find("not the page") == std::string::npos;
  }

  program_detail::Pipe orders_, answers_;
  pid_t child_ = -1;
};

struct Robot {
  Node node{"robot"};
  OutputPort<int> drive = node.output_port<int>("/drive:o");
  InputPort<int> motor = node.input_port<int>("/motor:i");
};

class AFormerOwner : public testing::Test {
 protected:
  void SetUp() override {
    if (!may_be_another_user()) GTEST_SKIP() << "only root can start processes of other users";
    start("allow everyone all\n");
  }
  void start(const std::string& policy) {
    daemon_.emplace(kModel,
                    Daemon::Options{.arguments = {"--policy", files_.write("policy", policy)}});
    ASSERT_EQ(::chmod(daemon_->directory().c_str(), 0711), 0);
    stranger_.emplace(daemon_->instance());
  }
  // He has the port open no longer, and may not open it again.
  void take_it_away() {
    ASSERT_EQ(stranger_->tell('c'), '+');
    files_.write("policy", "deny user 54321 output,deactivate /estop:o\nallow everyone all\n");
    daemon_->load(kModel);
  }

  TemporaryDirectory files_;
  std::optional<Daemon> daemon_;
  std::optional<FormerOwner> stranger_;
};

TEST_F(AFormerOwner, CannotEndHisSuccessorsEmergencyStop) {
  take_it_away();
  Robot robot;
  auto& [node, drive, motor] = robot;
  auto estop = node.output_port<int>("/estop:o");
  estop.signal();
  EXPECT_EQ(drive.publish(1).delivered, 0u);
  stranger_->tell('d');
  EXPECT_EQ(drive.publish(2).delivered, 0u);
  EXPECT_FALSE(motor.take());
  EXPECT_TRUE(daemon_->source("/estop:o")["active"]);
  estop.deactivate();
  stranger_->tell('s');
  EXPECT_EQ(drive.publish(3).delivered, 1u) << "nor stop the robot";
  EXPECT_TRUE(motor.take());
}

TEST_F(AFormerOwner, LeavesHisActivityToHisSuccessor) {
  stranger_->tell('s');
  take_it_away();
  Robot robot;
  auto& [node, drive, motor] = robot;
  EXPECT_EQ(drive.publish(1).delivered, 0u);
  auto estop = node.output_port<int>("/estop:o");
  stranger_->tell('d');
  EXPECT_EQ(drive.publish(2).delivered, 0u);
  estop.deactivate();
  EXPECT_EQ(drive.publish(3).delivered, 1u);
}

TEST_F(AFormerOwner, CannotBringBackWhatAnOperatorHasEnded) {
  stranger_->tell('s');
  take_it_away();
  Robot robot;
  auto& [node, drive, motor] = robot;
  EXPECT_EQ(drive.publish(1).delivered, 0u);
  RawClient arbiter(daemon_->instance());
  arbiter.hello("operator");
  arbiter.send(RawClient::message(MessageKind::kDeactivate, "/estop:o"));
  EXPECT_EQ(arbiter.expect(MessageKind::kDone).message.value, 1u);
  stranger_->tell('s');
  EXPECT_EQ(drive.publish(2).delivered, 1u);
  EXPECT_FALSE(daemon_->source("/estop:o")["active"]);
}

// Whoever flips his activity is inactive now and then.
TEST_F(AFormerOwner, CannotBringBackWhatAnOperatorFoundInactive) {
  stranger_->tell('s');
  stranger_->tell('d');
  take_it_away();
  Robot robot;
  auto& [node, drive, motor] = robot;
  RawClient arbiter(daemon_->instance());
  arbiter.hello("operator");
  arbiter.send(RawClient::message(MessageKind::kDeactivate, "/estop:o"));
  EXPECT_EQ(arbiter.expect(MessageKind::kDone).message.value, 0u);
  stranger_->tell('s');
  EXPECT_EQ(drive.publish(1).delivered, 1u);
  EXPECT_FALSE(daemon_->source("/estop:o")["active"]);
}

TEST_F(AFormerOwner, CannotHandBackHisPageToTheNextDaemon) {
  take_it_away();
  Robot robot;
  auto& [node, drive, motor] = robot;
  auto estop = node.output_port<int>("/estop:o");
  estop.signal();
  daemon_->kill();
  daemon_->restart();
  EXPECT_EQ(stranger_->tell('h'), '+');
  stranger_->tell('d');
  EXPECT_EQ(drive.publish(1).delivered, 0u);
  EXPECT_TRUE(daemon_->source("/estop:o")["active"]);
  estop.deactivate();
  EXPECT_EQ(drive.publish(2).delivered, 1u);
}

// A node that is serviced by nobody has not mapped the new page: its port delivers nothing that
// depends on it, and counts it.
TEST_F(AFormerOwner, IsNotReadByAPortThatHasNotSeenTheNextPage) {
  NodeOptions by_hand;
  by_hand.service_thread = false;
  Node slow("slow", by_hand);
  auto motor = slow.input_port<int>("/motor:i");
  Node node("robot");
  auto drive = node.output_port<int>("/drive:o");
  slow.service();
  EXPECT_EQ(drive.publish(1).delivered, 1u);
  EXPECT_TRUE(motor.take());
  take_it_away();
  slow.service();
  auto estop = node.output_port<int>("/estop:o");
  EXPECT_EQ(drive.publish(2).delivered, 1u);
  EXPECT_FALSE(motor.take());
  EXPECT_EQ(daemon_->input("/motor:i")["blind"], 1);
  slow.service();
  EXPECT_TRUE(motor.take());
}

ino_t inode_of(const shm::FileDescriptor& file) {
  struct stat status {};
  return ::fstat(file.get(), &status) == 0 ? status.st_ino : 0;
}

// What one user's components do to each other the kernel does not prevent either.
TEST(AnOwnerOfTheSameUser, KeepsThePage) {
  Daemon daemon(kModel);
  RawClient client(daemon.instance());
  client.hello();
  const auto segment = raw_output_segment();
  const auto first = open_raw_output(client, "/estop:o", segment);
  close_raw(client, first.message.port);
  const auto second = open_raw_output(client, "/estop:o", segment);
  EXPECT_EQ(inode_of(first.descriptors[0]), inode_of(second.descriptors[0]));
}

}  // namespace
}  // namespace arbiter::test
