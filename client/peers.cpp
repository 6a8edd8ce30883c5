#include "client/peers.hpp"

#include <stdexcept>

namespace arbiter::detail {

std::shared_ptr<const InputPeer> map_input_peer(const shm::Received& announced,
                                                const shm::TypeInfo& own,
                                                shm::Residence residence) {
  auto peer = std::make_shared<InputPeer>();
  peer->instance = announced.message.peer;
  peer->port = announced.message.id;
  const shm::FileDescriptor& segment = announced.descriptors[0];
  if (shm::checked_size(segment, shm::Seals::kOneWriter) != sizeof(shm::InputSegment)) {
    throw std::runtime_error("the input port's segment has another size");
  }
  peer->mapping = shm::Mapping(segment, sizeof(shm::InputSegment), shm::Access::kReadOnly);
  peer->segment = peer->mapping.as<const shm::InputSegment>();
  const shm::InputHeader& header = peer->segment->header;
  peer->depth = header.depth;
  peer->max_held = header.max_held;
  peer->refuse_new = header.refuse_new != 0;
  if (!peer->segment->is_consistent() || peer->depth < 1 || peer->depth > shm::kMaxDepth ||
      peer->max_held < 1 || peer->max_held > shm::kMaxHeld) {
    throw std::runtime_error("the input port's segment is not one of this version");
  }
  const bool connected = (announced.message.flags & shm::kIsConnected) != 0;
  const shm::TypeInfo type = header.type;
  if (const auto mismatch = shm::type_mismatch(own, type); connected && !mismatch.empty()) {
    throw std::runtime_error(mismatch);
  }
  peer->ringer = shm::Ringer(announced.descriptors[1]);
  shm::make_resident(peer->mapping, 0, sizeof(shm::InputSegment), residence);
  peer->bequest.emplace(peer->mapping.data(), peer->mapping.size(), shm::Bequest::Kind::kNothing);
  return peer;
}

std::shared_ptr<const OutputPeer> map_output_peer(const shm::Received& announced,
                                                  const shm::TypeInfo& own,
                                                  shm::Residence residence) {
  auto peer = std::make_shared<OutputPeer>();
  peer->instance = announced.message.peer;
  peer->link = announced.message.link;
  peer->source = announced.message.id;
  const shm::FileDescriptor& segment = announced.descriptors[0];
  const std::size_t size = shm::checked_size(segment, shm::Seals::kOneWriter);
  if (size < sizeof(shm::OutputHeader)) throw std::runtime_error("the segment is too small");
  peer->mapping = shm::Mapping(segment, size, shm::Access::kReadOnly);
  const auto* header = peer->mapping.as<const shm::OutputHeader>();
  const shm::OutputLayout layout = shm::OutputLayout::checked(*header, size);
  if (layout.total_size == 0) {
    throw std::runtime_error("the output port's segment is not one of this version");
  }
  const shm::TypeInfo type = header->type;
  if (const auto mismatch = shm::type_mismatch(type, own); !mismatch.empty()) {
    throw std::runtime_error(mismatch);
  }
  peer->segment = shm::OutputSegment(peer->mapping.data(), layout);
  shm::make_written_resident(segment, peer->mapping, residence);
  peer->bequest.emplace(peer->mapping.data(), peer->mapping.size(),
                        shm::Bequest::Kind::kNothingUnlessUsed, &peer->held);
  return peer;
}

}  // namespace arbiter::detail
