// The ports at the other ends of a port's connections, as the service thread has mapped them.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <arbiter/type.hpp>

#include "client/tap_peer.hpp"
#include "shm/atomic.hpp"
#include "shm/bell.hpp"
#include "shm/descendants.hpp"
#include "shm/ids.hpp"
#include "shm/input_segment.hpp"
#include "shm/output_segment.hpp"
#include "shm/residence.hpp"
#include "shm/segment.hpp"
#include "wire/messages.hpp"

namespace arbiter::detail {

// An input port, as an output port sees it. What the foreign segment says of itself is read once,
// here.
struct InputPeer {
  shm::PortInstance instance = 0;
  shm::PortId port = shm::kNone;
  std::string name;
  shm::Mapping mapping;
  std::optional<shm::Bequest> bequest;
  const shm::InputSegment* segment = nullptr;
  bool is_mapped = true;  // else the segment is an empty one of our own
  shm::Ringer ringer;
  std::uint32_t depth = 1;
  std::uint32_t max_held = 1;
  bool refuse_new = false;
  bool keep = false;
  // Set by the port's thread once its memory says what no honest one writes.
  mutable shm::Atomic<bool> misbehaved{false};
};

struct InputLink {
  std::shared_ptr<const InputPeer> peer;
  // Else the port only senses the source, or was disconnected and may still hold samples.
  bool connected = false;
  bool refused = false;      // it should be connected, but the types differ, or memory is short
  std::uint64_t number = 0;  // the daemon's: each time that it is connected another
  std::uint32_t channel = shm::kNone;  // none: waits until another link's is free
  std::uint32_t depth = 1;             // of the queue: the peer's, or less where memory is short
  std::uint64_t mask = 0;              // its bit in the masks of events; 0: it is no destination
};

struct OutputView {
  std::vector<InputLink> links;
  TapView taps;
  std::uint32_t slots = 0;  // allocated for the pool by now
  OutputView* next_retired = nullptr;
};

// An output port, as an input port sees it.
struct OutputPeer {
  shm::PortInstance instance = 0;
  std::uint64_t link = 0;  // as InputLink::number: the queue that is ours bears it
  shm::SourceId source = shm::kNone;
  Type type = Type::untyped(0);  // as it was judged; samples tell it
  shm::Mapping mapping;
  std::optional<shm::Bequest> bequest;  // a child keeps it if it was forked while samples were held
  mutable std::uint32_t held = 0;       // port's thread: samples of it that the component holds
  shm::OutputSegment segment;
  shm::FileDescriptor file;  // of the segment, opened by ourselves
  // How many slots are known to be allocated, header and payload: only these are read where they
  // lie. Written by the service thread. Relaxed is enough: what it says is true for ever, and the
  // kernel had it allocated before it was said.
  mutable shm::Atomic<std::uint32_t> allocated_slots{0};
  // By the port's thread: samples that it has copied, or would have, because their place was not
  // known to be allocated. Another number asks the service thread to look again. Relaxed is enough:
  // nothing is read by it, and the next copy asks again.
  mutable shm::Atomic<std::uint32_t> copied{0};
  // Set by the port's thread once a publisher that is gone has nothing left to be taken.
  mutable shm::Atomic<bool> drained{false};
  mutable shm::Atomic<bool> misbehaved{false};  // as InputPeer::misbehaved
};

struct OutputLink {
  std::shared_ptr<const OutputPeer> peer;
  bool gone = false;         // closed or dead: drain it
  bool reported = false;     // that it misbehaves
  bool offered = false;      // in the last view
  bool known = false;        // to the port's thread: a view that had it was accepted
  std::uint32_t copied = 0;  // of the peer's, when it was surveyed last
};

struct InputView {
  std::vector<OutputLink> links;
  // Since the port was opened: samples of publishers that were let go of before the port's thread
  // knew them. It counts them.
  std::uint64_t let_go = 0;
  std::vector<shm::SourceId> refused;  // those whose connection is refused
  InputView* next_retired = nullptr;
};

// A link as it is told to a daemon that takes over. Number 0: not connected, or refused.
struct HeldLink {
  shm::PortInstance peer = 0;
  std::uint64_t number = 0;
};

// The segment of an input port, whole and of this version; what it says of itself may be another
// thing a moment later. Throws as those below.
shm::Mapping map_input_segment(const shm::FileDescriptor& segment);

// Map what the daemon has announced, and check it: the segment must be whole, and carry a type that
// `own` can take or give. Throw std::runtime_error saying what is wrong, std::system_error where it
// cannot be locked.
std::shared_ptr<const InputPeer> map_input_peer(const wire::Received& announced,
                                                const shm::TypeInfo& own,
                                                shm::Residence residence = shm::Residence::kMapped);
std::shared_ptr<const OutputPeer> map_output_peer(
    const wire::Received& announced, const shm::TypeInfo& own,
    shm::Residence residence = shm::Residence::kMapped);

// In the place of an input port that should be connected and cannot be mapped: it holds nothing and
// waits for nothing.
std::shared_ptr<const InputPeer> unmapped_input_peer(shm::PortInstance instance, shm::PortId port,
                                                     std::string_view name);

// Service thread: looks how much the publisher has allocated by now. True: it is more than was
// known. Waits while the publisher allocates.
bool survey(const OutputPeer& peer);

}  // namespace arbiter::detail
