// What an output port tells those who tap it (shm/event_segment.hpp), in two parts.
//
// TapSeats is the service thread's: which taps there are, and where they are told; the segment of
// the events; the list of destinations that masks count by. EventTeller is the port's thread's: it
// writes the events, keeps the samples behind them, and rings for taps that sleep.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/tap_peer.hpp"
#include "shm/destination_list.hpp"
#include "shm/event_ring.hpp"
#include "shm/slot_pool.hpp"

namespace arbiter::detail {

// Of the numbers that slots have, so many are set aside for taps.
inline constexpr std::uint32_t kMaxTapSlots = 2 * shm::kMaxKept;

// How many slots a port reserves beside those of max_memory, for its taps alone; 0 where its
// samples are too large. Half of them are for samples that are kept, half for such as taps hold.
std::uint32_t slots_for_taps(std::uint64_t stride, std::uint32_t slots_of_components);

// The segment of a port's events. Made by the service thread, written by both threads: the lists by
// the service thread, all else by the port's.
class EventMemory {
 public:
  // Throws std::system_error.
  EventMemory(const shm::EventShape& shape, shm::Residence residence);

  [[nodiscard]] shm::EventSegment& segment() const noexcept {
    return *mapping_.as<shm::EventSegment>();
  }
  // For taps: the daemon passes it on as it is.
  [[nodiscard]] const shm::FileDescriptor& readable() const noexcept { return readable_; }

 private:
  shm::FileDescriptor descriptor_;
  shm::FileDescriptor readable_;
  shm::Mapping mapping_;
  std::optional<shm::Bequest> bequest_;
};

class TapSeats {
 public:
  // Takes a tap in, or finds the one that it is already, by its segment: a daemon that has taken
  // over gives it another number. Throws std::runtime_error where it does not fit.
  const TapSeat& add(std::shared_ptr<const TapPeer> peer, const std::string& port,
                     std::uint32_t slots_reserved, shm::Residence residence);
  // False: it was not there.
  bool remove(shm::PortInstance tap);
  // Nobody has said lately that they live.
  void doubt_all();
  void doubt(shm::PortInstance tap);
  // It reads no more, until it is added again: then it reads on from there.
  void end(shm::PortInstance tap);
  [[nodiscard]] bool has_doubtful() const;
  // Removes those that are in doubt and whose programs have gone. True: there were some.
  bool remove_dead();

  [[nodiscard]] bool empty() const noexcept { return seats_.empty(); }
  // Slots that their samples may take up, kept and held.
  [[nodiscard]] std::uint32_t slots() const;
  [[nodiscard]] const std::shared_ptr<const EventMemory>& memory() const noexcept {
    return memory_;
  }
  // With the list that says which destinations there are: another revision where it says something
  // else than the last.
  [[nodiscard]] TapView view(const shm::Destinations& destinations);

 private:
  void require_room(const TapPeer& peer, const std::string& port, std::uint32_t may_be_held) const;
  std::map<shm::PortInstance, TapSeat> seats_;
  std::shared_ptr<const EventMemory> memory_;  // stays, once there has been a tap
  shm::Destinations listed_;
  std::uint64_t revision_ = 0;
  std::uint64_t last_link_ = 0;
};

class EventTeller {
 public:
  [[nodiscard]] bool is_on() const noexcept { return is_on_; }

  // Another view: `state` is what the source is like now. A fence (b) must follow before the pool
  // is asked for a slot.
  void accept(const TapView& view, shm::EventRecord state, shm::SlotPool& pool);
  // Writes an event, with the list that is in force.
  void tell(shm::EventRecord& record, const shm::SampleOrigin& origin = {}) noexcept;
  // Keeps a sample; returns the slot of the one that gave way to it, or kNoSlot.
  [[nodiscard]] std::uint32_t keep(shm::Entry sample) noexcept { return writer_->keep(sample); }
  // Of an arrival under way: `mask` has refused it because its queue is full.
  void note_refusal(std::uint64_t mask) noexcept { refused_ |= mask; }
  [[nodiscard]] std::uint64_t refusals() noexcept { return std::exchange(refused_, 0); }

  [[nodiscard]] const std::vector<TapSeat>& seats() const noexcept { return seats_; }

 private:
  void ring_sleepers() noexcept;

  bool is_on_ = false;
  bool has_sleepers_ = false;
  std::shared_ptr<const EventMemory> memory_;
  std::optional<shm::EventWriter> writer_;
  std::uint64_t revision_ = 0;
  std::uint64_t refused_ = 0;
  std::vector<TapSeat> seats_;
};

}  // namespace arbiter::detail
