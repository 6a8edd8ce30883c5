#include "client/peers.hpp"

#include <fcntl.h>

#include <algorithm>
#include <stdexcept>

#include "client/types.hpp"

namespace arbiter::detail {

namespace {

std::uint32_t allocated_slots(const OutputPeer& peer) {
  const shm::OutputLayout& layout = peer.segment.layout();
  if (shm::allocated_size(peer.file) >= layout.total_size) return layout.slot_count;
  const auto slots = [&](std::uint64_t offset, std::uint64_t stride) {
    return (shm::end_of_data(peer.file, offset) - offset) / stride;
  };
  const std::uint64_t both = std::min(slots(layout.headers_offset, sizeof(shm::SlotHeader)),
                                      slots(layout.payload_offset, layout.stride));
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(both, layout.slot_count));
}

}  // namespace

shm::Mapping map_input_segment(const shm::FileDescriptor& segment) {
  if (shm::checked_size(segment, shm::Seals::kOneWriter) != sizeof(shm::InputSegment)) {
    throw std::runtime_error("the input port's segment has another size");
  }
  if (shm::allocated_size(segment) < sizeof(shm::InputSegment)) {
    throw std::runtime_error("the input port's memory is not allocated");
  }
  shm::Mapping mapping(segment, sizeof(shm::InputSegment), shm::Access::kReadOnly);
  if (!mapping.as<shm::InputSegment>()->is_consistent()) {
    throw std::runtime_error("the input port's segment is not one of this version");
  }
  return mapping;
}

std::shared_ptr<const InputPeer> map_input_peer(const wire::Received& announced,
                                                const shm::TypeInfo& own,
                                                shm::Residence residence) {
  auto peer = std::make_shared<InputPeer>();
  peer->instance = announced.message.peer;
  peer->port = announced.message.id;
  peer->name = announced.message.name_view();
  peer->mapping = map_input_segment(announced.descriptors[0]);
  peer->segment = peer->mapping.as<const shm::InputSegment>();
  const shm::InputHeader& header = peer->segment->header;
  peer->depth = header.depth;
  peer->max_held = header.max_held;
  peer->refuse_new = header.refuse_new != 0;
  peer->keep = header.keep != 0;
  // What is used is judged, whatever it was when it was mapped.
  if (peer->depth < 1 || peer->depth > shm::kMaxDepth || peer->max_held < 1 ||
      peer->max_held > shm::kMaxHeld) {
    throw std::runtime_error("the input port's segment is not one of this version");
  }
  const bool connected = (announced.message.flags & wire::kIsConnected) != 0;
  const shm::TypeInfo type = header.type;
  if (const auto mismatch = shm::type_mismatch(own, type); connected && !mismatch.empty()) {
    throw std::runtime_error(mismatch);
  }
  peer->ringer = shm::Ringer(announced.descriptors[1]);
  shm::make_resident(peer->mapping, 0, sizeof(shm::InputSegment), residence);
  peer->bequest.emplace(peer->mapping.data(), peer->mapping.size(), shm::Bequest::Kind::kNothing);
  return peer;
}

std::shared_ptr<const OutputPeer> map_output_peer(const wire::Received& announced,
                                                  const shm::TypeInfo& own,
                                                  shm::Residence residence) {
  auto peer = std::make_shared<OutputPeer>();
  peer->instance = announced.message.peer;
  peer->link = announced.message.link;
  peer->source = announced.message.id;
  const shm::FileDescriptor& segment = announced.descriptors[0];
  const std::size_t size = shm::checked_size(segment, shm::Seals::kOneWriter);
  if (size < shm::kOutputHeadBytes) throw std::runtime_error("the segment is too small");
  if (size > shm::kMaxSegmentSize) throw std::runtime_error("the segment is too large");
  peer->file = shm::reopen(segment, O_RDONLY);
  if (shm::end_of_data(peer->file, 0) < sizeof(shm::OutputHeader)) {
    throw std::runtime_error("the output port's memory is not allocated");
  }
  peer->mapping = shm::Mapping(segment, size, shm::Access::kReadOnly);
  const auto* header = peer->mapping.as<const shm::OutputHeader>();
  const shm::TypeInfo type = header->type;
  const shm::OutputLayout layout = shm::OutputLayout::checked(*header, type, size);
  if (layout.total_size == 0) {
    throw std::runtime_error("the output port's segment is not one of this version");
  }
  if (const auto fault = shm::fault_of(type)) {
    throw std::runtime_error("the output port's type is not one: " + *fault);
  }
  if (const auto mismatch = shm::type_mismatch(type, own); !mismatch.empty()) {
    throw std::runtime_error(mismatch);
  }
  peer->type = as_type(type);
  peer->segment = shm::OutputSegment(peer->mapping.data(), layout);
  shm::make_written_resident(peer->file, peer->mapping, residence);
  survey(*peer);
  shm::close_in_children(peer->file);
  peer->bequest.emplace(peer->mapping.data(), peer->mapping.size(),
                        shm::Bequest::Kind::kNothingUnlessUsed, &peer->held);
  return peer;
}

bool survey(const OutputPeer& peer) {
  const std::uint32_t known = peer.allocated_slots.load(std::memory_order_relaxed);
  const std::uint32_t allocated = allocated_slots(peer);
  peer.allocated_slots.store(allocated, std::memory_order_relaxed);
  return allocated > known;
}

std::shared_ptr<const InputPeer> unmapped_input_peer(shm::PortInstance instance, shm::PortId port,
                                                     std::string_view name) {
  // On the heap, where it costs no program 36 KB of its file; never freed, for peers of a node that
  // ends with the process still point at it.
  static const auto* const nobody = new shm::InputSegment{};
  auto peer = std::make_shared<InputPeer>();
  peer->instance = instance;
  peer->port = port;
  peer->name = name;
  peer->segment = nobody;
  peer->is_mapped = false;
  peer->max_held = 0;
  return peer;
}

}  // namespace arbiter::detail
