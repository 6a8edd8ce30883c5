// A queue and a slot pool without the ports around them, which can be explored further.
#pragma once

#include <cstddef>
#include <cstring>
#include <vector>

#include "shm/channel.hpp"
#include "shm/output_segment.hpp"
#include "shm/slot_pool.hpp"
#include "tests/explore/explorer.hpp"

namespace arbiter::explore {

// An output port's segment at one address for all executions.
class SegmentMemory {
 public:
  static constexpr std::uint32_t kSlots = 8;

  // Zeroed as far as the scenarios use it.
  shm::OutputSegment fresh() {
    shm::TypeInfo type;
    type.size = sizeof(std::uint64_t);
    const auto layout = shm::OutputLayout::plan(type, kSlots);
    if (memory_.empty()) memory_.resize(layout.total_size + shm::kPageSize);
    const auto address = reinterpret_cast<std::uintptr_t>(memory_.data());
    std::byte* const base = memory_.data() + (shm::kPageSize - address % shm::kPageSize);
    std::memset(base, 0, layout.rings_offset + shm::kRingBytes);
    std::memset(base + layout.headers_offset, 0, layout.total_size - layout.headers_offset);
    return {base, layout};
  }

 private:
  std::vector<std::byte> memory_;
};

// publish() and take() as the ports have them, reduced to one queue; the parts are the real ones,
// in the same order.
struct Publisher {
  shm::OutputSegment segment;
  shm::ChannelWriter writer;
  shm::SlotPool pool;
  shm::PortInstance instance = 0;
  Plain<std::uint64_t>* payloads = nullptr;
  const shm::Atomic<shm::Hold>* holds = nullptr;
  std::uint32_t hold_count = 0;
  std::uint64_t published = 0;
  // How far the receiver is; null: its publisher does not look, as with samples that are small.
  const shm::Atomic<std::uint64_t>* consumed = nullptr;

  std::uint32_t acquire() {
    if (consumed != nullptr) {
      writer.forget(*consumed, [&](std::uint32_t slot) { pool.evict(slot); });
    }
    const std::uint32_t slot = pool.acquire(
        instance, [&](auto&& each) { each(holds, hold_count); }, consumed != nullptr);
    require(slot != shm::kNoSlot, "no slot is free");
    return slot;
  }
  std::uint32_t write_sample() {
    const std::uint32_t slot = acquire();
    payloads[slot].write(++published);
    return slot;
  }
  void push(std::uint32_t slot) {
    pool.add_reference(slot);
    const std::uint32_t evicted = writer.push(slot);
    if (evicted != shm::kNoSlot) pool.evict(evicted);
  }
  void publish_fence() { shm::full_fence(); }  // (b)
  void publish() {
    const std::uint32_t slot = write_sample();
    push(slot);
    publish_fence();
    pool.end_loan(slot);
  }
};

struct Receiver {
  shm::ChannelReader reader;
  shm::Atomic<shm::Hold>* hold = nullptr;
  Plain<std::uint64_t>* payloads = nullptr;
  std::uint64_t lost = 0;
  std::uint64_t last = 0;
  shm::Atomic<std::uint64_t>* consumed = nullptr;  // its word for how far it is

  // Takes, reads and gives back one sample; what it reads must be what was published.
  bool take() {
    const shm::Entry entry = reader.peek(lost);
    if (entry == 0 || !reader.hold(entry, *hold)) return false;
    const std::uint64_t value = payloads[shm::slot_of(entry)].read();
    require(value == shm::sequence_of(entry), "a sample was torn or replaced");
    require(value > last, "a sample came twice, or late");
    last = value;
    reader.consume();
    if (consumed != nullptr) reader.tell(*consumed);
    shm::ChannelReader::release(*hold);
    return true;
  }
  // The same with the port's order of things: it says that it is done with the entry as soon as it
  // holds the slot, and reads later.
  bool take_and_read_later() {
    const shm::Entry entry = reader.peek(lost);
    if (entry == 0 || !reader.hold(entry, *hold)) return false;
    reader.consume();
    reader.tell(*consumed);
    require(payloads[shm::slot_of(entry)].read() == shm::sequence_of(entry),
            "a sample was written over while it was held");
    last = shm::sequence_of(entry);
    shm::ChannelReader::release(*hold);
    return true;
  }
};

}  // namespace arbiter::explore
