// A tap, as an output port sees it, and the taps that its port's thread knows.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "shm/bell.hpp"
#include "shm/descendants.hpp"
#include "shm/ids.hpp"
#include "shm/residence.hpp"
#include "shm/segment.hpp"
#include "shm/tap_segment.hpp"
#include "wire/messages.hpp"

namespace arbiter::detail {

class EventMemory;  // client/output/events.hpp

// What the foreign segment says of itself is read once, when it is mapped.
struct TapPeer {
  shm::PortInstance instance = 0;  // the daemon's number for it, when it was mapped
  shm::SegmentIdentity identity;   // of the segment: by it a tap is known again
  shm::Mapping mapping;
  std::optional<shm::Bequest> bequest;
  const shm::TapSegment* segment = nullptr;
  std::uint32_t max_held = 0;
  bool sleeps = true;
  bool is_privileged = false;  // root's, or of the daemon's own user
  uid_t user = 0;              // else whose it is
  shm::Ringer ringer;
};

struct TapSeat {
  std::shared_ptr<const TapPeer> peer;
  std::uint32_t place = 0;
  std::uint64_t link = 0;    // the port's own number for it; never given twice
  bool has_ended = false;    // service thread: it reads us no more, but may hold samples
  bool is_doubtful = false;  // service thread: no daemon says that it lives
  std::uint64_t rung = 0;    // port's thread: the wait that we rang for last
};

// The taps in a view.
struct TapView {
  std::shared_ptr<const EventMemory> memory;  // null: there has been no tap yet
  std::vector<TapSeat> seats;
  std::uint64_t revision = 0;  // of the list of destinations
};

// Maps what the daemon has announced, and checks it. Throws std::runtime_error saying what is
// wrong, std::system_error.
std::shared_ptr<const TapPeer> map_tap_peer(const wire::Received& announced,
                                            shm::Residence residence);

}  // namespace arbiter::detail
