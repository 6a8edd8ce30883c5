// A publisher that says another type each time that its memory is looked at.
#include <fcntl.h>
#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <thread>

#include "client/peers.hpp"
#include "shm/output_segment.hpp"
#include "shm/segment.hpp"

namespace arbiter::test {
namespace {

shm::TypeInfo type_of_size(std::uint64_t size) {
  shm::TypeInfo type;
  type.set_name("scan");
  type.size = size;
  return type;
}

// What is judged is what is used: a slot has room for the type that the receiver takes, or the two
// are not connected. Otherwise it would read beyond the segment's end.
TEST(ATypeThatChangesWhileItIsLookedAt, GivesNoSlotTooSmallForASample) {
  constexpr std::uint64_t kSmall = 64;
  const shm::TypeInfo wanted = type_of_size(1 << 20);
  const shm::OutputLayout layout = shm::OutputLayout::plan(type_of_size(kSmall), 1);
  const shm::FileDescriptor segment = shm::make_segment("hostile", layout.total_size);
  ASSERT_FALSE(shm::allocate(segment, 0, layout.total_size));
  const shm::Mapping mapping(segment, layout.total_size, shm::Access::kReadWrite);
  auto& header = *mapping.as<shm::OutputHeader>();
  header.magic = shm::OutputHeader::kMagic;
  header.version = shm::OutputHeader::kVersion;
  header.slot_count = layout.slot_count;
  header.type = wanted;
  shm::seal(segment, shm::Seals::kOneWriter);
  std::atomic<bool> done = false;
  std::thread liar([&] {
    for (const std::atomic_ref<std::uint64_t> size(header.type.size); !done;) {
      size.store(kSmall, std::memory_order_relaxed);
      size.store(wanted.size, std::memory_order_relaxed);
    }
  });
  int deceived = 0;
  for (int i = 0; i < 20'000; ++i) {
    wire::Received announced;
    announced.descriptors[0] = shm::reopen(segment, O_RDONLY);
    try {
      const auto peer = detail::map_output_peer(announced, wanted, shm::Residence::kMapped);
      deceived += peer->segment.layout().stride < wanted.size ? 1 : 0;
    } catch (const std::runtime_error&) {  // refused
    }
  }
  done = true;
  liar.join();
  EXPECT_EQ(deceived, 0);
}

}  // namespace
}  // namespace arbiter::test
