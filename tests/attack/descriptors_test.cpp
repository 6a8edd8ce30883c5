// What a client can do to the daemon by the descriptors that it sends along: by those that take for
// ever to close, and by those that it may name but not open.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <deque>
#include <string>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "service/clients/errands.hpp"
#include "shm/bell.hpp"
#include "shm/foreign.hpp"
#include "shm/input_segment.hpp"
#include "shm/output_segment.hpp"
#include "tests/attack/attacker.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/other_user.hpp"
#include "tests/support/raw_port.hpp"

namespace arbiter::test {
namespace {

using shm::FileDescriptor;
using wire::MessageKind;

// A TCP connection whose peer does not read: closing it waits for an hour. The last who closes it
// waits; so whoever sends it stops the daemon, closes its own, and lets the daemon go on.
class Lingering {
 public:
  Lingering() {
    const FileDescriptor listener(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    auto* const name = reinterpret_cast<sockaddr*>(&address);
    socklen_t size = sizeof address;
    require(::bind(listener.get(), name, size) == 0 && ::listen(listener.get(), 1) == 0 &&
            ::getsockname(listener.get(), name, &size) == 0);
    end_.reset(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    require(::connect(end_.get(), name, size) == 0);
    peer_.reset(::accept4(listener.get(), nullptr, nullptr, SOCK_CLOEXEC));
    const linger an_hour{1, 3600};
    require(peer_ &&
            ::setsockopt(end_.get(), SOL_SOCKET, SO_LINGER, &an_hour, sizeof an_hour) == 0);
    const std::vector<char> unread(1 << 16);
    while (::send(end_.get(), unread.data(), unread.size(), MSG_DONTWAIT) > 0) {
    }
  }

  [[nodiscard]] int get() const { return end_.get(); }
  void close() { end_.reset(); }
  // Closing it waits no more.
  void release() { peer_.reset(); }

 private:
  static void require(bool succeeded) {
    if (!succeeded) throw std::runtime_error("a connection to linger at cannot be made");
  }
  FileDescriptor end_;
  FileDescriptor peer_;
};

shm::TypeInfo some_type(std::uint64_t size) {
  shm::TypeInfo type;
  type.size = size;
  return type;
}

FileDescriptor output_segment(std::uint64_t sample_size, std::uint32_t slots) {
  const auto layout = shm::OutputLayout::plan(some_type(sample_size), slots);
  auto segment = shm::make_segment("attack", layout.total_size);
  EXPECT_FALSE(shm::allocate(segment, 0, shm::kOutputHeadBytes));
  const shm::Mapping mapping(segment, shm::kOutputHeadBytes, shm::Access::kReadWrite);
  auto& header = *mapping.as<shm::OutputHeader>();
  header.magic = shm::OutputHeader::kMagic;
  header.version = shm::OutputHeader::kVersion;
  header.slot_count = slots;
  header.type = some_type(sample_size);
  shm::seal(segment, shm::Seals::kOneWriter);
  return segment;
}

// Any number of descriptors, more than a client library would send. False: nobody listens.
bool try_to_send_with(int socket, const wire::Message& message,
                      const std::vector<int>& descriptors) {
  iovec data{const_cast<wire::Message*>(&message), sizeof message};
  std::vector<char> control(CMSG_SPACE(sizeof(int) * descriptors.size()));
  msghdr header{};
  header.msg_iov = &data;
  header.msg_iovlen = 1;
  header.msg_control = control.data();
  header.msg_controllen = control.size();
  cmsghdr* const part = CMSG_FIRSTHDR(&header);
  part->cmsg_level = SOL_SOCKET;
  part->cmsg_type = SCM_RIGHTS;
  part->cmsg_len = CMSG_LEN(sizeof(int) * descriptors.size());
  std::memcpy(CMSG_DATA(part), descriptors.data(), sizeof(int) * descriptors.size());
  return ::sendmsg(socket, &header, MSG_NOSIGNAL) > 0;
}

void send_with(int socket, const wire::Message& message, const std::vector<int>& descriptors) {
  ASSERT_TRUE(try_to_send_with(socket, message, descriptors));
}

void expect_that_others_are_served(Daemon& daemon) {
  Node node("honest");
  auto out = node.output_port<int>("/honest:o");
  auto in = node.input_port<int>("/honest:i");
  EXPECT_FALSE(daemon.source("/honest:o").is_null());
}

void wait_until_a_thread_is_lost(Daemon& daemon) {
  while (daemon.log().find("keeps a thread waiting") == std::string::npos) {
    daemon.status();  // and it answers
  }
}

class ALingeringSocket : public testing::Test {
 protected:
  explicit ALingeringSocket(Daemon::Options options = {}) : daemon_(kNoRules, std::move(options)) {}

  RawClient client() {
    RawClient result(daemon_.instance());
    result.hello("attacker");
    return result;
  }
  // Sends it in such a way that the daemon is the last to close it.
  template <class Send>
  void give(Lingering& lingering, Send send) {
    daemon_.process().stop();
    send(lingering.get());
    lingering.close();
    daemon_.process().signal(SIGCONT);
  }
  void expect_no_harm() {
    expect_that_others_are_served(daemon_);
    wait_until_a_thread_is_lost(daemon_);
    expect_that_others_are_served(daemon_);
    EXPECT_EQ(daemon_.terminate(), 0) << "it does not wait for what is lost";
  }

  Daemon daemon_;
};

TEST_F(ALingeringSocket, AsAWantedDescriptorHoldsUpNobody) {
  Lingering lingering;
  RawClient attacker = client();
  give(lingering, [&](int fd) {
    attacker.send(RawClient::message(MessageKind::kOpenOutput, "/attacker:o"), {fd, -1});
  });
  EXPECT_NE(attacker.expect_refusal().find("neither a memfd nor an anonymous pipe"),
            std::string::npos);
  expect_no_harm();
}

TEST_F(ALingeringSocket, AsOneTooManyHoldsUpNobody) {
  Lingering lingering;
  RawClient attacker = client();
  const FileDescriptor zero(::open("/dev/zero", O_RDONLY | O_CLOEXEC));
  give(lingering, [&](int fd) {
    std::vector<int> many(wire::kMostDescriptorsOfAMessage, zero.get());
    many.back() = fd;
    send_with(attacker.socket(), RawClient::message(MessageKind::kStatus), many);
  });
  expect_no_harm();
}

// Who opens a name that somebody has open makes the daemon read ahead what that client has sent: it
// may have closed the port. What comes so in a message that is none is not closed by the loop
// either.
TEST_F(ALingeringSocket, AsOneTooManyInAMessageThatIsReadAheadHoldsUpNobody) {
  Lingering lingering;
  const FileDescriptor segment = raw_output_segment();
  RawClient holder = client();
  open_raw_output(holder, "/attacker:o", segment);
  RawClient other = client();
  give(lingering, [&](int fd) {
    // Heard first, so served first.
    other.send(RawClient::message(MessageKind::kOpenOutput, "/attacker:o"), {segment.get(), -1});
    send_with(holder.socket(), RawClient::message(MessageKind::kStatus),
              {segment.get(), segment.get(), fd});
  });
  expect_no_harm();
}

TEST_F(ALingeringSocket, InAMessageThatIsNeverReadHoldsUpNobody) {
  Lingering lingering;
  {
    RawClient attacker = client();
    give(lingering, [&](int fd) {
      attacker.send_bytes("?", 1);  // the daemon hangs up on that
      send_with(attacker.socket(), RawClient::message(MessageKind::kStatus), {fd});
    });
    EXPECT_TRUE(attacker.is_hung_up_on());
  }
  expect_no_harm();
}

TEST_F(ALingeringSocket, InsideASocketHoldsUpNobody) {
  Lingering lingering;
  RawClient attacker = client();
  int ends[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends), 0);
  FileDescriptor inner(ends[0]);
  const FileDescriptor outer(ends[1]);
  give(lingering, [&](int fd) {
    send_with(outer.get(), RawClient::message(MessageKind::kStatus), {fd});
    send_with(attacker.socket(), RawClient::message(MessageKind::kStatus), {inner.get()});
    inner.reset();
  });
  expect_no_harm();
}

// More than there are threads for one user: the rest waits, and another user's is done.
TEST_F(ALingeringSocket, SentManyTimesHoldsUpNobody) {
  std::vector<Lingering> many(6);
  RawClient attacker = client();
  daemon_.process().stop();
  for (Lingering& each : many) {
    send_with(attacker.socket(), RawClient::message(MessageKind::kStatus), {each.get()});
    each.close();
  }
  daemon_.process().signal(SIGCONT);
  expect_that_others_are_served(daemon_);
  while (daemon_.log().find("4 of 4") == std::string::npos) daemon_.status();
  expect_that_others_are_served(daemon_);
}

// Once all threads of a user are lost, what comes after waits, and keeps its descriptors: it must
// not use up those of others.
class AUserWhoseThreadsAreLost : public ALingeringSocket {
 protected:
  // A thread, and all that may wait for one, and a message that is read before that is seen.
  static constexpr std::size_t kMostKept = service::Errands::kMaxLostOfAUser +
                                           service::Errands::kMaxWaiting +
                                           2 * wire::kMostDescriptorsOfAMessage;

  explicit AUserWhoseThreadsAreLost(Daemon::Options options = {})
      : ALingeringSocket(std::move(options)) {
    RawClient attacker = client();
    daemon_.process().stop();
    for (Lingering& each : lingering_) {
      send_with(attacker.socket(), RawClient::message(MessageKind::kStatus), {each.get()});
      each.close();
    }
    daemon_.process().signal(SIGCONT);
    while (daemon_.log().find("4 of 4") == std::string::npos) daemon_.status();
  }

  std::vector<Lingering> lingering_{service::Errands::kMaxLostOfAUser};
};

TEST_F(AUserWhoseThreadsAreLost, CostsNothingByConnectingAgainAndAgain) {
  const std::size_t before = daemon_.open_descriptors();
  for (int i = 0; i < 2000; ++i) {
    RawClient again(daemon_.instance());
    again.send(RawClient::message(MessageKind::kStatus));
  }
  expect_that_others_are_served(daemon_);
  EXPECT_LT(daemon_.open_descriptors(), before + 100);
}

TEST_F(AUserWhoseThreadsAreLost, IsGivenUpBeforeItKeepsThoseOfOthers) {
  const std::size_t before = daemon_.open_descriptors();
  const FileDescriptor zero(::open("/dev/zero", O_RDONLY | O_CLOEXEC));
  const std::vector<int> many(wire::kMostDescriptorsOfAMessage, zero.get());
  for (int i = 0; i < 20; ++i) {
    RawClient again(daemon_.instance());
    try_to_send_with(again.socket(), RawClient::message(MessageKind::kStatus), many);
    again.is_hung_up_on();
  }
  EXPECT_LT(daemon_.open_descriptors(), before + kMostKept);
  for (Lingering& each : lingering_) each.release();
  while (daemon_.open_descriptors() > before) {
  }
  expect_that_others_are_served(daemon_);
}

// Who has all that he may have is turned away before anything is read from him.
class AUserWithoutThreadsOrShare : public AUserWhoseThreadsAreLost {
 protected:
  AUserWithoutThreadsOrShare()
      : AUserWhoseThreadsAreLost({.arguments = {"--user-share", "10"}, .max_descriptors = 3000}) {}

  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "only root can start processes of other users";
    ASSERT_EQ(::chmod(daemon_.directory().c_str(), 0711), 0);
    try {
      for (;;) clients_.emplace_back(daemon_.instance()).hello();
    } catch (const std::runtime_error&) {  // has been turned away
    }
    clients_.pop_back();
    const FileDescriptor zero(::open("/dev/zero", O_RDONLY | O_CLOEXEC));
    for (std::size_t waiting = 0; waiting < service::Errands::kMaxWaiting; waiting += 2) {
      send_with(clients_.back().socket(), RawClient::message(MessageKind::kConnect),
                {zero.get(), zero.get()});
      clients_.back().expect_refusal();
    }
  }

  std::deque<RawClient> clients_;
};

TEST_F(AUserWithoutThreadsOrShare, CostsNothingByConnectingAgainAndAgain) {
  const std::size_t before = daemon_.open_descriptors();
  for (int i = 0; i < 2000; ++i) RawClient again(daemon_.instance());
  // Who comes later is let in later.
  EXPECT_EQ(as_user(kStranger,
                    [] {
                      Node node("honest");
                      auto out = node.output_port<int>("/honest:o");
                      return std::string("opened");
                    }),
            "opened");
  EXPECT_LT(daemon_.open_descriptors(), before + 30);
}

// A daemon of root must not open for others what they could not open themselves.
class ABellThatIsHandedIn : public testing::Test {
 protected:
  std::string refusal(int bell) {
    RawClient client(daemon_.instance());
    client.hello("attacker");
    const FileDescriptor segment = raw_input_segment();
    client.send(RawClient::message(MessageKind::kOpenInput, "/attacker:i"), {segment.get(), bell});
    return client.expect_refusal();
  }
  Daemon daemon_;
};

TEST_F(ABellThatIsHandedIn, IsNoFifoOfADirectory) {
  const std::string path = daemon_.directory() + "/pipe:[1]";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  for (const int flags : {O_PATH, O_RDWR}) {
    const FileDescriptor fifo(::open(path.c_str(), flags | O_CLOEXEC));
    EXPECT_NE(refusal(fifo.get()).find("neither a memfd nor an anonymous pipe"), std::string::npos);
  }
  const FileDescriptor reader(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  const FileDescriptor writer(::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC));
  EXPECT_NE(refusal(writer.get()).find("neither"), std::string::npos);
}

TEST_F(ABellThatIsHandedIn, IsNoPipeThatWasNotOpenedToBeWritten) {
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
  const FileDescriptor read_end(ends[0]);
  const FileDescriptor write_end(ends[1]);
  EXPECT_NE(refusal(read_end.get()).find("write end"), std::string::npos);
  const FileDescriptor named(
      ::open(("/proc/self/fd/" + std::to_string(ends[1])).c_str(), O_PATH | O_CLOEXEC));
  EXPECT_NE(refusal(named.get()).find("neither"), std::string::npos);
}

TEST_F(ABellThatIsHandedIn, IsNotAnotherUsersNorIsTheSegment) {
  if (!may_be_another_user()) GTEST_SKIP() << "only root can become another user";
  ASSERT_EQ(::chmod(daemon_.directory().c_str(), 0711), 0);
  const shm::Bell bell;
  // A copy: a forked child has none of the library's own descriptors.
  const FileDescriptor roots_bell(::fcntl(bell.write_end().get(), F_DUPFD_CLOEXEC, 0));
  const FileDescriptor roots_segment = raw_input_segment();
  const auto said = as_user(kStranger, [&] {
    const shm::Bell own_bell;
    const FileDescriptor own_segment = raw_input_segment();
    RawClient client(daemon_.instance());
    client.hello("attacker");
    std::string refusals;
    const auto open = RawClient::message(MessageKind::kOpenInput, "/attacker:i");
    client.send(open, {own_segment.get(), roots_bell.get()});
    refusals += client.expect_refusal() + "; ";
    client.send(open, {roots_segment.get(), own_bell.write_end().get()});
    refusals += client.expect_refusal() + "; ";
    client.send(open, {own_segment.get(), own_bell.write_end().get()});
    client.expect(MessageKind::kConnected);
    return refusals;
  });
  EXPECT_EQ(said,
            "the bell was made by user 0, and handed in by user 54321; "
            "the segment was made by user 0, and handed in by user 54321; ");
}

// Memory that a stranger makes others map, read and pay for.
TEST(ASparseSegment, TakesNoAddressesOfTheDaemon) {
  Daemon daemon;
  RawClient attacker(daemon.instance());
  attacker.hello("attacker");
  const auto addresses = [&] {
    std::ifstream file("/proc/" + std::to_string(daemon.process().pid()) + "/statm");
    std::size_t pages = 0;
    file >> pages;
    return pages * shm::kPageSize;
  };
  const std::size_t before = addresses();
  constexpr std::uint64_t kGigabyte = std::uint64_t{1} << 30;
  std::vector<FileDescriptor> segments;
  for (int i = 0; i < 60; ++i) {
    segments.push_back(output_segment(kGigabyte, 15));
    auto open = RawClient::message(MessageKind::kOpenOutput, "/attacker:o" + std::to_string(i));
    open.type = some_type(kGigabyte);
    attacker.send(open, {segments.back().get(), -1});
    attacker.expect(MessageKind::kConnected);
  }
  EXPECT_LT(addresses() - before, kGigabyte) << "60 segments of 15 GiB";
  const FileDescriptor larger = output_segment(kGigabyte, 17);
  auto open = RawClient::message(MessageKind::kOpenOutput, "/attacker:larger");
  open.type = some_type(kGigabyte);
  attacker.send(open, {larger.get(), -1});
  EXPECT_NE(attacker.expect_refusal().find("kMaxSegmentSize"), std::string::npos);
}

// What holds what is allocated in place: the seals, on this kernel.
TEST(ASealedSegment, LosesNoPageThroughItsOwnersMapping) {
  const auto segment = shm::make_segment("attack", 4 * shm::kPageSize);
  const shm::Mapping mapping(segment, 4 * shm::kPageSize, shm::Access::kReadWrite);
  ASSERT_FALSE(shm::allocate(segment, 0, 2 * shm::kPageSize));
  mapping.data()[0] = std::byte{1};
  shm::seal(segment, shm::Seals::kOneWriter);
  const std::size_t before = shm::allocated_size(segment);
  EXPECT_EQ(before, 2 * shm::kPageSize);
  for (const int advice : {MADV_REMOVE, MADV_DONTNEED, MADV_FREE, MADV_PAGEOUT, MADV_COLD}) {
    static_cast<void>(::madvise(mapping.data(), 2 * shm::kPageSize, advice));
    EXPECT_EQ(shm::allocated_size(segment), before) << advice;
  }
  for (const int mode : {FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, FALLOC_FL_ZERO_RANGE,
                         FALLOC_FL_COLLAPSE_RANGE}) {
    EXPECT_NE(::fallocate(segment.get(), mode, 0, shm::kPageSize), 0) << mode;
  }
  // Nor can it be allocated where nobody would look for it.
  EXPECT_NE(::fallocate(segment.get(), FALLOC_FL_KEEP_SIZE, 4 * shm::kPageSize, shm::kPageSize), 0);
  EXPECT_NE(::ftruncate(segment.get(), 0), 0);
  EXPECT_EQ(shm::allocated_size(segment), before);
  EXPECT_EQ(mapping.data()[0], std::byte{1});
}

TEST(ASegmentOfHugePages, IsNotTaken) {
  const FileDescriptor huge(
      ::memfd_create("attack", MFD_HUGETLB | MFD_ALLOW_SEALING | MFD_CLOEXEC));
  if (!huge) GTEST_SKIP() << "this kernel has no huge pages";
  EXPECT_EQ(shm::foreign_kind(huge.get()), shm::ForeignKind::kOther);
}

}  // namespace
}  // namespace arbiter::test
