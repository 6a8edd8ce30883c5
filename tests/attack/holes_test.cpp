// A publisher whose samples lie in memory that nobody has allocated: whoever reads it by a load
// allocates it, and pays.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <string>

#include <arbiter/arbiter.hpp>

#include "shm/output_segment.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/hear_all.hpp"

namespace arbiter::test {
namespace {

using wire::MessageKind;

constexpr std::uint32_t kSlots = 64;

constexpr std::ptrdiff_t kSampleSize = 1 << 20;

// A hostile publisher, below the client library: it publishes slot after slot, touching none.
class ASampleThatIsAHole : public testing::Test {
 protected:
  ASampleThatIsAHole() {
    type_.size = kSampleSize;
    const auto layout = shm::OutputLayout::plan(type_, kSlots);
    file_ = shm::make_segment("attack", layout.total_size);
    // All but the samples.
    EXPECT_FALSE(shm::allocate(file_, 0, layout.payload_offset));
    mapping_ = shm::Mapping(file_, layout.total_size, shm::Access::kReadWrite);
    std::memset(mapping_.data(), 0, layout.payload_offset);
    segment_ = shm::OutputSegment(mapping_.data(), layout);
  }

  void open() {
    auto& header = segment_.header();
    header.magic = shm::OutputHeader::kMagic;
    header.version = shm::OutputHeader::kVersion;
    header.slot_count = kSlots;
    header.type = type_;
    shm::seal(file_, shm::Seals::kOneWriter);
    attacker_.hello("attacker");
    auto open = RawClient::message(MessageKind::kOpenOutput, "/attacker:o");
    open.type = type_;
    attacker_.send(open, {file_.get(), -1});
    wire::Received received;
    while (attacker_.receive(received) && received.message.kind != MessageKind::kConnected) {
      if (received.message.kind == MessageKind::kInputPeer) link_ = received.message.link;
    }
    ASSERT_NE(link_, 0u);
    hear_all(node_);
    segment_.channel(0).first = 1;
    segment_.channel(0).depth = 1;
    segment_.channel(0).receiver = link_;
    segment_.header().joins = 1;
  }

  void publish(std::uint32_t slot, std::uint64_t sequence) {
    segment_.slot_header(slot).size = kSampleSize;
    segment_.slot_header(slot).sequence = sequence;
    segment_.ring(0, link_)[0] = shm::make_entry(sequence, slot);
    segment_.channel(0).accepted = sequence;
  }

  shm::TypeInfo type_;
  shm::FileDescriptor file_;
  shm::Mapping mapping_;
  shm::OutputSegment segment_;
  std::uint64_t link_ = 0;
  Daemon daemon_{
      "<behaviors><arbiter at='/prey:i'><select from='/attacker:o'/></arbiter></behaviors>"};
  Node node_{"prey"};
  RawClient attacker_{daemon_.instance()};
};

TEST_F(ASampleThatIsAHole, IsReadWithoutBeingAllocated) {
  auto in = node_.input_port("/prey:i", {.depth = 1});
  open();
  const std::size_t before = shm::allocated_size(file_);
  for (std::uint32_t i = 0; i < kSlots; ++i) {
    publish(i, i + 1);
    const auto sample = in.take();
    ASSERT_TRUE(sample) << i;
    ASSERT_EQ(sample->size(), kSampleSize);
    const std::byte* const bytes = sample->data();
    EXPECT_EQ(std::count(bytes, bytes + kSampleSize, std::byte{0}), kSampleSize);
  }
  EXPECT_EQ(shm::allocated_size(file_), before) << "64 MiB that the reader would have paid";
}

}  // namespace
}  // namespace arbiter::test
