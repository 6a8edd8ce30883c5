// Clients that come back from somewhere that they never were, or claim what was never theirs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <filesystem>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "service/kept/registry.hpp"
#include "shm/activity.hpp"
#include "shm/output_segment.hpp"
#include "shm/segment.hpp"
#include "shm/table_ring.hpp"
#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/raw_port.hpp"
#include "tests/support/resting.hpp"

namespace arbiter::test {
namespace {

using wire::MessageKind;

wire::Message return_as(std::uint64_t node) {
  auto message = RawClient::message(MessageKind::kHello, "impostor");
  message.value = wire::kWireVersion;
  message.flags = wire::kComesBack | wire::kRejoins;
  message.link = node;
  return message;
}

// A board and a registry as the daemon gives them to everybody.
struct Given {
  shm::FileDescriptor board;
  shm::FileDescriptor registry;
  std::uint64_t node = 0;

  explicit Given(const Daemon& daemon) {
    RawClient client(daemon.instance());
    auto hello = RawClient::message(MessageKind::kHello, "curious");
    hello.value = wire::kWireVersion;
    client.send(hello);
    wire::Received welcome = client.expect(MessageKind::kWelcome);
    board = std::move(welcome.descriptors[0]);
    registry = std::move(welcome.descriptors[1]);
    node = welcome.message.link;
  }
};

shm::FileDescriptor sealed(std::size_t size) {
  auto segment = shm::make_segment("forged", size);
  shm::seal(segment, shm::Seals::kFixedSize);
  return segment;
}

TEST(HostileReturn, WithAnythingButTheBoardIsRefused) {
  Daemon daemon(single_model());
  const Given given(daemon);
  const auto forged = sealed(sizeof(shm::Board));
  const shm::FileDescriptor event(eventfd(0, 0));
  const std::vector<RawClient::Descriptors> tries{
      {-1, -1},
      {forged.get(), given.registry.get()},
      {given.registry.get(), given.board.get()},
      {event.get(), event.get()},
  };
  for (const auto& descriptors : tries) {
    RawClient impostor(daemon.instance());
    impostor.send(return_as(1), descriptors);
    EXPECT_NE(impostor.expect_refusal(), "(hung up)");
    // It is not heard any more.
    impostor.send(RawClient::message(MessageKind::kStatus));
  }
  EXPECT_EQ(daemon.status()["clients"], 1);
}

// All of this is said by a process that has the board, as any client has it, but never had the
// port.
TEST(HostileReturn, GetsNoPortOfAnotherProcess) {
  Daemon daemon(single_model());
  Component victim("victim");
  ASSERT_EQ(victim.tell("output /out"), "open");
  Component receiver("receiver");
  ASSERT_EQ(receiver.tell("input /in 8 1 0"), "open");
  const Given given(daemon);
  const auto segment = sealed(4096);
  for (const bool is_away : {false, true}) {
    if (is_away) {
      victim.process().stop();
      daemon.kill();
      daemon.restart();
      EXPECT_TRUE(daemon.source("/out")["away"]);
    }
    for (std::uint64_t id = 0; id <= given.node; ++id) {
      RawClient impostor(daemon.instance());
      ASSERT_EQ(impostor.send(return_as(id), {given.board.get(), given.registry.get()}),
                wire::SendResult::kSent);
      impostor.expect(MessageKind::kWelcome);
      for (std::uint64_t port = 0; port < 4; ++port) {
        auto claim = RawClient::message(MessageKind::kHandBackOutput, "/out");
        claim.port = port;
        impostor.send(claim, {segment.get(), segment.get()});
        EXPECT_NE(impostor.expect_refusal().find("never had"), std::string::npos);
        claim.kind = MessageKind::kHandBackInput;
        impostor.send(claim, {segment.get(), segment.get()});
        EXPECT_NE(impostor.expect_refusal().find("never had"), std::string::npos);
        claim.kind = MessageKind::kHandBackLink;
        claim.peer = port + 1;
        claim.link = 1;
        impostor.send(claim);
        claim.kind = MessageKind::kClosePort;
        impostor.send(claim);
      }
      impostor.send(RawClient::message(MessageKind::kHandedBack));
    }
    if (is_away) victim.process().signal(SIGCONT);
    EXPECT_EQ(victim.tell("publish /out 5"), "1 0 0");
    EXPECT_EQ(receiver.tell("take /in"), "5");
    await([&] { return daemon.source("/out")["open"] == true; });
  }
}

// Pages that it may write, or has made, in place of one that others read.
TEST(HostileReturn, PutsNoPageInPlaceOfAnother) {
  Daemon daemon(override_model());
  Node node("good");
  auto low = node.output_port<Number>("/low");
  auto stop = node.output_port<Number>("/stop");
  auto in = node.input_port<Number>("/in");
  stop.signal();
  const Given given(daemon);
  const auto forged = sealed(sizeof(shm::ActivityPage));
  daemon.kill();
  daemon.restart();
  RawClient impostor(daemon.instance());
  impostor.send(return_as(99), {given.board.get(), given.registry.get()});
  impostor.expect(MessageKind::kWelcome);
  for (std::uint32_t id = 0; id < 5; ++id) {
    auto message = RawClient::message(MessageKind::kHandBackPage);
    message.id = id;
    for (const int fd : {forged.get(), given.board.get(), -1}) {
      impostor.send(message, {fd, -1});
      EXPECT_NE(impostor.expect_refusal(), "(hung up)");
    }
  }
  impostor.send(RawClient::message(MessageKind::kHandedBack));
  EXPECT_TRUE(daemon.source("/stop")["active"]);
  EXPECT_EQ(low.publish(Number{1}).delivered, 0u);
  stop.deactivate();
  EXPECT_FALSE(daemon.source("/stop")["active"]);
  EXPECT_EQ(low.publish(Number{1}).delivered, 1u);
}

// What a successor believes is what the predecessor wrote down, not what comes first.
// Its activity would be nowhere. The port is not taken back then, and its name is free.
TEST(HostileReturn, HandsBackNoOutputWithoutThePageInForce) {
  Daemon daemon(single_model());
  auto hello = RawClient::message(MessageKind::kHello, "liar");
  hello.value = wire::kWireVersion;
  hello.flags = wire::kComesBack;
  RawClient former(daemon.instance());
  former.send(hello);
  const wire::Received welcome = former.expect(MessageKind::kWelcome);
  const auto segment = raw_output_segment();
  const wire::Message opened = open_raw_output(former, "/out", segment).message;
  daemon.kill();
  daemon.restart();
  RawClient liar(daemon.instance());
  liar.send(return_as(welcome.message.link),
            {welcome.descriptors[0].get(), welcome.descriptors[1].get()});
  liar.expect(MessageKind::kWelcome);
  auto output = RawClient::message(MessageKind::kHandBackOutput, "/out");
  output.port = opened.port;
  output.id = opened.id;
  const auto page = sealed(sizeof(shm::ActivityPage));
  liar.send(output, {segment.get(), page.get()});
  EXPECT_NE(liar.expect_refusal().find("a page that is not its own"), std::string::npos);
  liar.send(RawClient::message(MessageKind::kHandedBack));
  Node node("honest");
  auto in = node.input_port<Number>("/in");
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
}

// It is no lie, and the component goes on publishing: nobody else may have the name.
TEST(HostileReturn, WithWhatTheDaemonHasNoDescriptorForCostsNobodyItsPort) {
  Daemon daemon(single_model());
  RawClient former(daemon.instance());
  const wire::Received welcome = former.hello("poor", wire::kComesBack);
  const auto segment = raw_output_segment();
  const wire::Received opened = open_raw_output(former, "/out", segment);
  daemon.kill();
  daemon.restart();
  auto output = RawClient::message(MessageKind::kHandBackOutput, "/out");
  output.port = opened.message.port;
  output.id = opened.message.id;
  const auto come_back = [&] {
    RawClient poor(daemon.instance());
    poor.send(return_as(welcome.message.link),
              {welcome.descriptors[0].get(), welcome.descriptors[1].get()});
    poor.expect(MessageKind::kWelcome);
    return poor;
  };
  const auto hand_back = [&](RawClient& poor) {
    poor.send(output, {segment.get(), opened.descriptors[0].get()});
  };
  struct Round {
    int many;     // fewer each time, for the limit cannot be raised again
    rlim_t left;  // descriptors, in which the message comes and nothing else
    const char* why;
  };
  const std::string refusal = "no descriptor left";
  for (const auto& [many, left, why] :
       {Round{32, 0, refusal.c_str()}, Round{24, 0, refusal.c_str()},
        Round{16, 2, "Too many open files"}}) {
    RawClient memory = come_back();  // from here on the daemon serves
    const pid_t process = daemon.process().pid();
    const std::string descriptors = "/proc/" + std::to_string(process) + "/fd/";
    const auto first_free = [&] {
      rlim_t number = 0;
      while (std::filesystem::is_symlink(descriptors + std::to_string(number))) ++number;
      return number;
    };
    const auto count = [&] {
      const std::filesystem::directory_iterator all(descriptors);
      return std::distance(begin(all), end(all));
    };
    wait_until_all_rest(process);
    const auto before = count();
    std::vector<RawClient> others;
    const auto connect = [&] { others.emplace_back(daemon.instance()).hello(); };
    for (int i = 0; i < many; ++i) connect();
    RawClient poor = come_back();
    wait_until_all_rest(process);
    for (int i = 0; i < 4; ++i) connect();  // in place of the conversation that this has ended
    wait_until_all_rest(process);           // it neither closes any, nor sets its limit itself
    const rlim_t used = first_free();
    const rlimit few{used + left, used + left};  // where it receives, it raises the soft one
    ASSERT_EQ(::prlimit(process, RLIMIT_NOFILE, &few, nullptr), 0);
    hand_back(poor);
    EXPECT_THAT(poor.expect_refusal(), testing::HasSubstr(why));
    others.clear();
    await([&] { return count() <= before + 2; });  // those of the one that is left
    poor.send(RawClient::message(MessageKind::kHandedBack));
    EXPECT_TRUE(poor.is_hung_up_on());
  }
  EXPECT_TRUE(daemon.source("/out")["away"]);
  {
    Node thief("thief");
    EXPECT_THROW(static_cast<void>(thief.output_port<Number>("/out")), Error);
  }
  RawClient poor = come_back();
  hand_back(poor);
  poor.send(RawClient::message(MessageKind::kHandedBack));
  await([&] { return daemon.source("/out")["open"] == true; });
  // A component comes again twenty times a second: the log has it once, and when it is over.
  const std::string log = daemon.log();
  const auto said = log.find(refusal);
  ASSERT_NE(said, std::string::npos) << log;
  EXPECT_EQ(log.find(refusal, said + 1), std::string::npos) << log;
  EXPECT_NE(log.find("is back, with 1 port", said), std::string::npos) << log;
}

TEST(HostileReturn, ToANewDaemonWithAnOldBoardIsRefusedAndOthersAreTakenBack) {
  Daemon daemon(single_model());
  const Given old(daemon);
  daemon.terminate();  // nobody had a port: the next one begins anew
  daemon.restart();
  Component component("component");
  ASSERT_EQ(component.tell("output /out"), "open");
  daemon.kill();
  component.process().stop();
  daemon.restart();
  RawClient impostor(daemon.instance());
  impostor.send(return_as(1), {old.board.get(), old.registry.get()});
  EXPECT_EQ(impostor.expect_refusal(), "this daemon's predecessor had other memory");
  component.process().signal(SIGCONT);
  await([&] { return daemon.log().find("is back, with") != std::string::npos; });
  EXPECT_TRUE(daemon.source("/out")["open"]);
  EXPECT_EQ(daemon.generation(), 2u);
}

// Numbers of nodes begin anew with each daemon's memory: another node of this process may have had
// the same one elsewhere.
TEST(HostileReturn, WithANumberOfOtherMemoryCostsNobodyWhatIsKept) {
  Daemon daemon(single_model());
  wire::Received welcome;
  {
    RawClient lost(daemon.instance());
    welcome = lost.hello("lost", wire::kComesBack);
    const auto segment = raw_output_segment();
    open_raw_output(lost, "/out", segment);
  }
  await([&] { return daemon.source("/out")["away"] == true; });
  auto hello = RawClient::hello_message("another", wire::kRejoins | wire::kHasNoPorts);
  hello.link = welcome.message.link;
  const auto other_memory = shm::make_segment("other", 4096);
  RawClient another(daemon.instance());
  another.send(hello, {other_memory.get(), other_memory.get()});
  another.expect(MessageKind::kWelcome);
  another.send(RawClient::message(MessageKind::kHandBackPage), {other_memory.get(), -1});
  another.send(RawClient::message(MessageKind::kHandedBack));
  another.send(RawClient::message(MessageKind::kStatus));
  another.expect(MessageKind::kStatusReply);
  EXPECT_TRUE(daemon.source("/out")["away"]);
  RawClient itself(daemon.instance());
  itself.send(hello, {welcome.descriptors[0].get(), welcome.descriptors[1].get()});
  itself.send(RawClient::message(MessageKind::kHandedBack));
  itself.expect(MessageKind::kWelcome);
  EXPECT_FALSE(daemon.source("/out")["away"]);
}

std::set<int> sockets() {
  std::set<int> found;
  for (int fd = 0; fd < 1024; ++fd) {
    int type = 0;
    socklen_t size = sizeof type;
    if (::getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) == 0) found.insert(fd);
  }
  return found;
}

// A component that the daemon drops although it lives keeps its ports, and what it holds.
TEST(HostileReturn, OfAComponentThatWasDroppedKeepsWhatItHas) {
  Daemon daemon(single_model());
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /out"), "open");
  const std::set<int> before = sockets();
  Node node("babbler");
  std::set<int> of_the_node = sockets();
  for (const int fd : before) of_the_node.erase(fd);
  ASSERT_EQ(of_the_node.size(), 1u);
  auto in = node.input_port<Number>("/in", {.depth = 1});
  sender.tell("publish /out 1");
  auto held = in.take();
  ASSERT_TRUE(held);
  for (int i = 0; i < 5; ++i) {
    const char noise[] = "noise";
    ::send(*of_the_node.begin(), noise, sizeof noise, MSG_NOSIGNAL);
    EXPECT_EQ(sender.tell("publish /out 2 50"), "1 0 0");
    EXPECT_EQ((**held).value, 1);
    await([&] { return daemon.input("/in")["open"] == true; });
    EXPECT_EQ(daemon.connection("/out", "/in")["state"], "connected");
    of_the_node = sockets();
    for (const int fd : before) of_the_node.erase(fd);
  }
  held.reset();
  EXPECT_EQ(take_from(in), 51);
}

}  // namespace
}  // namespace arbiter::test
