// What a client can do to the daemon by what it hands in as a bell or a segment: by descriptors
// that it may name but not open, and by memory that others map.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <fstream>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "shm/bell.hpp"
#include "shm/foreign.hpp"
#include "shm/output_segment.hpp"
#include "tests/attack/attacker.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/other_user.hpp"
#include "tests/support/raw_port.hpp"

namespace arbiter::test {
namespace {

using shm::FileDescriptor;
using wire::MessageKind;

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
