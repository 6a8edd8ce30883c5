#include "client/tap_peer.hpp"

#include <stdexcept>

namespace arbiter::detail {

std::shared_ptr<const TapPeer> map_tap_peer(const wire::Received& announced,
                                            shm::Residence residence) {
  auto peer = std::make_shared<TapPeer>();
  peer->instance = announced.message.peer;
  const shm::FileDescriptor& segment = announced.descriptors[0];
  if (shm::checked_size(segment, shm::Seals::kOneWriter) != sizeof(shm::TapSegment)) {
    throw std::runtime_error("the tap's segment has another size");
  }
  if (shm::allocated_size(segment) < sizeof(shm::TapSegment)) {
    throw std::runtime_error("the tap's memory is not allocated");
  }
  peer->identity = shm::identity_of(segment);
  peer->mapping = shm::Mapping(segment, sizeof(shm::TapSegment), shm::Access::kReadOnly);
  peer->segment = peer->mapping.as<const shm::TapSegment>();
  peer->max_held = peer->segment->max_held;
  peer->sleeps = peer->segment->sleeps != 0;
  peer->user = announced.message.value;
  peer->is_privileged = (announced.message.flags & wire::kIsPrivileged) != 0;
  if (!peer->segment->is_consistent() || peer->max_held > shm::kMaxTapHeld) {
    throw std::runtime_error("the tap's segment is not one of this version");
  }
  peer->ringer = shm::Ringer(announced.descriptors[1]);
  shm::make_resident(peer->mapping, 0, sizeof(shm::TapSegment), residence);
  peer->bequest.emplace(peer->mapping.data(), peer->mapping.size(), shm::Bequest::Kind::kNothing);
  return peer;
}

}  // namespace arbiter::detail
