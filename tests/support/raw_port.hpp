// Ports that are opened below the client library.
#pragma once

#include <stdexcept>
#include <string>

#include "shm/input_segment.hpp"
#include "shm/output_segment.hpp"
#include "shm/tap_segment.hpp"
#include "tests/support/raw_client.hpp"

namespace arbiter::test {

inline shm::FileDescriptor raw_output_segment() {
  const shm::TypeInfo type;
  const auto layout = shm::OutputLayout::plan(type, 4);
  auto segment = shm::make_segment("test", layout.total_size);
  if (shm::allocate(segment, 0, layout.total_size)) throw std::runtime_error("no memory");
  {
    const shm::Mapping mapping(segment, layout.total_size, shm::Access::kReadWrite);
    auto& header = *mapping.as<shm::OutputHeader>();
    header.magic = shm::OutputHeader::kMagic;
    header.version = shm::OutputHeader::kVersion;
    header.slot_count = 4;
    header.type = type;
  }
  shm::seal(segment, shm::Seals::kOneWriter);
  return segment;
}

inline shm::FileDescriptor raw_input_segment() {
  auto segment = shm::make_segment("test", sizeof(shm::InputSegment));
  if (shm::allocate(segment, 0, sizeof(shm::InputSegment))) throw std::runtime_error("no memory");
  {
    const shm::Mapping mapping(segment, sizeof(shm::InputSegment), shm::Access::kReadWrite);
    auto& header = mapping.as<shm::InputSegment>()->header;
    header.magic = shm::InputHeader::kMagic;
    header.version = shm::InputHeader::kVersion;
    header.depth = 1;
    header.max_held = 1;
    header.newest_link.store(UINT64_MAX, std::memory_order_relaxed);  // takes up whatever comes
  }
  shm::seal(segment, shm::Seals::kOneWriter);
  return segment;
}

inline shm::FileDescriptor raw_tap_segment() {
  auto segment = shm::make_segment("test", sizeof(shm::TapSegment));
  if (shm::allocate(segment, 0, sizeof(shm::TapSegment))) throw std::runtime_error("no memory");
  {
    const shm::Mapping mapping(segment, sizeof(shm::TapSegment), shm::Access::kReadWrite);
    auto& tap = *mapping.as<shm::TapSegment>();
    tap.magic = shm::TapSegment::kMagic;
    tap.version = shm::TapSegment::kVersion;
    tap.max_held = 1;
  }
  shm::seal(segment, shm::Seals::kOneWriter);
  return segment;
}

// kOpened, with the source's page. Throws what the daemon refuses with.
inline wire::Received open_raw_output(RawClient& client, const std::string& name,
                                      const shm::FileDescriptor& segment) {
  client.send(RawClient::message(wire::MessageKind::kOpenOutput, name), {segment.get(), -1});
  wire::Received opened = client.expect(wire::MessageKind::kOpened);
  client.expect(wire::MessageKind::kConnected);
  return opened;
}

inline void close_raw(RawClient& client, shm::PortInstance port) {
  auto close = RawClient::message(wire::MessageKind::kClosePort);
  close.port = port;
  client.send(close);
}

}  // namespace arbiter::test
