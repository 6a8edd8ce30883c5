// Clients that say anything but what they should: they are refused or dropped, and nobody else
// notices.
#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <deque>
#include <random>
#include <thread>

#include <arbiter/arbiter.hpp>

#include "shm/bell.hpp"
#include "shm/input_segment.hpp"
#include "shm/output_segment.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/raw_port.hpp"

namespace arbiter::test {
namespace {

using wire::MessageKind;

const std::string kOneSource =
    "<behaviors><arbiter at='/in'><select from='/out'/></arbiter></behaviors>";

// A daemon with two components that go on as if nothing were the matter.
class HostileClient : public testing::Test {
 protected:
  void TearDown() override {
    EXPECT_EQ(out_.publish(7).delivered, 1u);
    auto sample = in_.take();
    ASSERT_TRUE(sample);
    EXPECT_EQ(**sample, 7);
    Node newcomer("newcomer");
    auto port = newcomer.output_port<int>("/newcomer");
  }

  RawClient client() {
    RawClient result(daemon_.instance());
    result.hello("hostile");
    return result;
  }
  std::string refusal(const wire::Message& message, RawClient::Descriptors descriptors = {-1, -1}) {
    RawClient hostile = client();
    hostile.send(message, descriptors);
    return hostile.expect_refusal();
  }

  // The input port, in the place of the one that goes on. Returns what it is told of /out.
  wire::Message open_in_its_place(RawClient& hostile) {
    { auto closed = std::move(in_); }
    const auto segment = raw_input_segment();
    hostile.send(RawClient::message(MessageKind::kOpenInput, "/in"),
                 {segment.get(), bell_.write_end().get()});
    return hostile.expect(MessageKind::kOutputPeer).message;
  }
  void give_back(RawClient& hostile, shm::PortInstance port) {
    auto close = RawClient::message(MessageKind::kClosePort);
    close.port = port;
    hostile.send(close);
    in_ = node_.input_port<int>("/in");
  }

  const shm::Bell bell_;  // of a hostile one's input port
  Daemon daemon_{kOneSource};
  Node node_{"good"};
  OutputPort<int> out_ = node_.output_port<int>("/out");
  InputPort<int> in_ = node_.input_port<int>("/in");
};

shm::FileDescriptor output_segment(shm::TypeInfo type, std::uint32_t slots = 4) {
  const auto layout = shm::OutputLayout::plan(type, slots);
  auto segment = shm::make_segment("test", layout.total_size);
  EXPECT_FALSE(shm::allocate(segment, 0, layout.rings_offset));
  const shm::Mapping mapping(segment, layout.total_size, shm::Access::kReadWrite);
  auto& header = *mapping.as<shm::OutputHeader>();
  header.magic = shm::OutputHeader::kMagic;
  header.version = shm::OutputHeader::kVersion;
  header.slot_count = slots;
  header.type = type;
  return segment;
}

wire::Message open_output(const std::string& name) {
  auto message = RawClient::message(MessageKind::kOpenOutput, name);
  message.type.size = 8;
  return message;
}

TEST_F(HostileClient, ThatSendsNoiseIsDropped) {
  std::mt19937 random(20251121);
  for (int round = 0; round < 100; ++round) {
    RawClient hostile(daemon_.instance());
    std::vector<unsigned char> noise(random() % 3000 + 1);
    for (auto& byte : noise) byte = static_cast<unsigned char>(random());
    hostile.send_bytes(noise.data(), noise.size());
    wire::Received received;
    while (hostile.receive(received)) {
      ASSERT_EQ(received.message.kind, MessageKind::kRefused);
      break;
    }
  }
}

TEST_F(HostileClient, ThatSendsRandomMessagesAfterItsHelloHarmsNobody) {
  std::mt19937_64 random(4711);
  for (int round = 0; round < 50; ++round) {
    RawClient hostile = client();
    for (int i = 0; i < 40; ++i) {
      wire::Message message;
      message.kind =
          static_cast<MessageKind>(random() % 4 == 0 ? 40 + random() % 6 : random() % 14);
      if (message.kind == MessageKind::kStop) continue;  // this user may, and would
      message.flags = static_cast<std::uint32_t>(random());
      message.request = random() % 8;
      message.port = random() % 12;
      message.peer = random() % 12;
      message.id = static_cast<std::uint32_t>(random() % 8);
      message.value = static_cast<std::uint32_t>(random());
      if (random() % 2 == 0) message.set_name(random() % 2 == 0 ? "/out" : "/in");
      if (random() % 4 == 0) message.set_text("why not");
      if (hostile.send(message) != wire::SendResult::kSent) break;
    }
  }
}

TEST_F(HostileClient, ThatSendsTruncatedOrOversizedMessagesIsDropped) {
  for (const std::size_t size :
       {std::size_t{1}, std::size_t{7}, sizeof(wire::Message) + 1, std::size_t{60000}}) {
    RawClient hostile = client();
    const std::vector<char> bytes(size, 3);
    hostile.send_bytes(bytes.data(), bytes.size());
    EXPECT_TRUE(hostile.is_hung_up_on()) << size;
  }
}

TEST_F(HostileClient, MustSayHelloFirstAndOnce) {
  RawClient hostile(daemon_.instance());
  hostile.send(open_output("/x"));
  EXPECT_NE(hostile.expect_refusal().find("hello first"), std::string::npos);
  hostile.hello();
  hostile.send(RawClient::message(MessageKind::kHello, "again"));
  EXPECT_NE(hostile.expect_refusal().find("hello once"), std::string::npos);
}

TEST_F(HostileClient, OfAnotherVersionIsToldSo) {
  RawClient hostile(daemon_.instance());
  auto hello = RawClient::message(MessageKind::kHello, "old");
  hello.value = wire::kWireVersion + 1;
  hostile.send(hello);
  EXPECT_NE(hostile.expect_refusal().find("speaks version"), std::string::npos);
}

TEST_F(HostileClient, CannotTakeANameThatBreaksALine) {
  const std::map<std::string, std::string> refusals{
      {"/a\nb", "has white space in it"},
      {"/a b", "has white space in it"},
      {"/a\u009b", "has an invisible character in it"},
      {"x", "a port's name begins with '/'"},
      {"", "a port's name begins with '/'"}};
  for (const auto& [name, expected] : refusals) {
    const auto segment = output_segment({});
    shm::seal(segment, shm::Seals::kOneWriter);
    const std::string why = refusal(open_output(name), {segment.get(), -1});
    EXPECT_NE(why.find(expected), std::string::npos) << why;
  }
}

TEST_F(HostileClient, CannotOpenAPortWithoutASegment) {
  EXPECT_NE(refusal(open_output("/x")).find("0 descriptors instead of 1"), std::string::npos);
  EXPECT_NE(refusal(RawClient::message(MessageKind::kOpenInput, "/x")).find("instead of 2"),
            std::string::npos);
}

TEST_F(HostileClient, CannotPassOtherKindsOfDescriptorsForASegment) {
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
  const shm::FileDescriptor read_end(ends[0]);
  const shm::FileDescriptor write_end(ends[1]);
  const shm::FileDescriptor null(::open("/dev/zero", O_RDWR | O_CLOEXEC));
  const shm::FileDescriptor event(::eventfd(0, EFD_CLOEXEC));
  const shm::FileDescriptor directory(::open("/", O_RDONLY | O_CLOEXEC));
  const auto unsealed = output_segment({});
  const auto half_sealed = output_segment({});
  shm::seal(half_sealed, shm::Seals::kFixedSize);
  const auto empty = shm::make_segment("empty", 0);
  shm::seal(empty, shm::Seals::kOneWriter);
  const auto zeros = shm::make_segment("zeros", 1 << 20);
  shm::seal(zeros, shm::Seals::kOneWriter);
  for (const int fd : {write_end.get(), read_end.get(), null.get(), event.get(), directory.get(),
                       unsealed.get(), half_sealed.get(), empty.get(), zeros.get()}) {
    EXPECT_NE(refusal(open_output("/x"), {fd, -1}), "(hung up)");
    EXPECT_NE(refusal(RawClient::message(MessageKind::kOpenInput, "/x"), {fd, write_end.get()}),
              "(hung up)");
  }
}

TEST_F(HostileClient, CannotPassAnotherThingForABell) {
  const auto segment = raw_input_segment();
  const shm::FileDescriptor event(::eventfd(0, EFD_CLOEXEC));
  const std::string why =
      refusal(RawClient::message(MessageKind::kOpenInput, "/x"), {segment.get(), event.get()});
  EXPECT_NE(why.find("neither a memfd nor an anonymous pipe"), std::string::npos) << why;
}

TEST_F(HostileClient, CannotClaimALayoutThatItsSegmentDoesNotHave) {
  shm::TypeInfo type;
  type.size = 64;
  for (int what = 0; what < 4; ++what) {
    const auto segment = output_segment(type);
    {
      const auto size = shm::OutputLayout::plan(type, 4).total_size;
      const shm::Mapping mapping(segment, size, shm::Access::kReadWrite);
      auto& header = *mapping.as<shm::OutputHeader>();
      if (what == 0) header.slot_count = 60000;
      if (what == 1) header.type.size = ~std::uint64_t{0};
      if (what == 2) header.type.alignment = 3;
      if (what == 3) header.version = 99;
    }
    shm::seal(segment, shm::Seals::kOneWriter);
    EXPECT_NE(refusal(open_output("/x"), {segment.get(), -1}).find("segment"), std::string::npos);
  }
}

TEST_F(HostileClient, CannotCloseOrRefuseOthersPorts) {
  RawClient hostile = client();
  for (shm::PortInstance port = 0; port < 10; ++port) {
    auto close = RawClient::message(MessageKind::kClosePort);
    close.port = port;
    hostile.send(close);
    for (shm::PortInstance peer = 0; peer < 10; ++peer) {
      auto refuse = RawClient::message(MessageKind::kPeerRefused);
      refuse.port = port;
      refuse.peer = peer;
      hostile.send(refuse);
    }
  }
  EXPECT_EQ(hostile.status()["inputs"][0]["connections"][0]["state"], "connected");
}

TEST_F(HostileClient, CannotDeactivateASourceThatALiveComponentHas) {
  EXPECT_NE(refusal(RawClient::message(MessageKind::kDeactivate, "/out")).find("held by"),
            std::string::npos);
  EXPECT_NE(refusal(RawClient::message(MessageKind::kDeactivate, "/nobody")).find("/nobody"),
            std::string::npos);
}

TEST_F(HostileClient, ThatNeverReadsHoldsUpNobody) {
  RawClient deaf = client();
  const auto segment = output_segment({});
  shm::seal(segment, shm::Seals::kOneWriter);
  deaf.send(open_output("/deaf"), {segment.get(), -1});
  auto observe = RawClient::message(MessageKind::kObserve);
  deaf.send(observe);
  // Each of these is told to the one who observes: far more than a socket takes.
  for (int i = 0; i < 300; ++i) {
    auto port = node_.input_port<int>("/many" + std::to_string(i));
  }
  EXPECT_EQ(daemon_.source("/deaf")["open"], true);
}

TEST_F(HostileClient, ThatAsksAndNeverReadsIsGivenUpInTheEnd) {
  RawClient deaf = client();
  int asked = 0;
  while (asked < 100000 &&
         deaf.send(RawClient::message(MessageKind::kStatus)) == wire::SendResult::kSent) {
    ++asked;
  }
  EXPECT_LT(asked, 100000);
}

TEST_F(HostileClient, ThatAsksWithoutEndLetsOthersBeServed) {
  std::atomic<bool> stop{false};
  std::thread flood([&] {
    RawClient hostile = client();
    const auto status = RawClient::message(MessageKind::kClosePort);
    while (!stop) hostile.send(status);
  });
  for (int i = 0; i < 50; ++i) {
    Node node("busy");
    auto port = node.output_port<int>("/busy");
  }
  stop = true;
  flood.join();
}

TEST_F(HostileClient, ThatConnectsAndSaysNothingHarmsNobody) {
  std::vector<RawClient> silent;
  for (int i = 0; i < 200; ++i) silent.emplace_back(daemon_.instance());
  Node node("test");
}

// An input port whose component could not take up its publisher: the publisher is told, and does
// not count it any more.
// More than it may: the oldest give way, and whoever speaks is served.
TEST_F(HostileClient, TenThousandThatConnectAndSayNothingHarmNobody) {
  std::deque<RawClient> silent;
  for (int i = 0; i < 10'000; ++i) {
    silent.emplace_back(daemon_.instance());
    if (silent.size() > 400) silent.pop_front();
    if (i % 1000 == 0) client();
  }
  // Once it has taken up who came last, and threads have closed what was of those who went.
  await([&] { return daemon_.open_descriptors() <= 2 * shm::kMaxSilentClients + 64; });
  EXPECT_TRUE(silent.front().is_hung_up_on());
}

TEST_F(HostileClient, CannotBeMoreThanTheLimitOfItsUser) {
  std::deque<RawClient> many;
  std::string refusal;
  while (refusal.empty() && many.size() < shm::kMaxClients) {
    many.emplace_back(daemon_.instance());
    many.back().send(RawClient::hello_message("many"));
    wire::Received answer;
    ASSERT_TRUE(many.back().receive(answer));
    if (answer.message.kind == MessageKind::kRefused) refusal = answer.message.text_view();
  }
  EXPECT_NE(refusal.find("kMaxClients"), std::string::npos) << refusal;
  EXPECT_EQ(many.size(), shm::kMaxClients / 2);  // with the good one, and without this
  many.clear();
  await([&] { return daemon_.open_descriptors() <= 100; });
}

TEST_F(HostileClient, ThatRefusesItsPeerIsNotDeliveredTo) {
  RawClient refusing = client();
  const wire::Message peer = open_in_its_place(refusing);
  refusing.expect(MessageKind::kConnected);
  EXPECT_EQ(out_.publish(1).delivered, 1u);
  auto refusal = RawClient::message(MessageKind::kPeerRefused);
  refusal.port = peer.port;
  refusal.peer = peer.peer;
  refusal.set_text("no memory");
  refusing.send(refusal);
  EXPECT_EQ(refusing.status()["inputs"][0]["connections"][0]["mismatch"], "no memory");
  { auto elsewhere = node_.input_port<int>("/elsewhere"); }  // the node has heard of it by now
  EXPECT_EQ(out_.publish(2).delivered, 0u);
  give_back(refusing, peer.port);
}

// Else the link would be neither connected nor refused, and nobody told of its end.
TEST_F(HostileClient, ThatRefusesItsPeerForNoReasonIsGivenOne) {
  RawClient refusing = client();
  const wire::Message peer = open_in_its_place(refusing);
  auto refusal = RawClient::message(MessageKind::kPeerRefused);
  refusal.port = peer.port;
  refusal.peer = peer.peer;
  refusing.send(refusal);
  EXPECT_EQ(refusing.status()["inputs"][0]["connections"][0]["mismatch"],
            "its component gives no reason");
  { auto closed = std::move(out_); }
  EXPECT_EQ(refusing.expect(MessageKind::kPeerGone).message.peer, peer.peer);
  give_back(refusing, peer.port);
  out_ = node_.output_port<int>("/out");
}

TEST_F(HostileClient, ThatObservesIsToldEachNameOnce) {
  RawClient observer = client();
  observer.send(RawClient::message(MessageKind::kObserve));
  observer.expect(MessageKind::kDone);
  std::vector<InputPort<int>> ports;
  for (int i = 0; i < 20; ++i) {
    ports.push_back(node_.input_port<int>("/many" + std::to_string(i)));
  }
  for (int i = 0; i < 20; ++i) {
    const auto told = observer.expect(MessageKind::kPortName);
    EXPECT_EQ(told.message.name_view(), "/many" + std::to_string(i));
  }
  observer.send(RawClient::message(MessageKind::kObserve));
  wire::Received next;
  ASSERT_TRUE(observer.receive(next));
  EXPECT_EQ(next.message.kind, MessageKind::kDone) << "there is no more to tell";
}

}  // namespace
}  // namespace arbiter::test
