#include "link/core/event_header.hpp"

#include "link/core/little_endian.hpp"

namespace arbiter::link {
namespace {

constexpr std::uint32_t kEventMagic = 0x4c425241;  // "ARBL"
constexpr std::uint8_t kEventVersion = 1;
constexpr std::uint16_t kDeactivatedFlag = 1;

// What each kind says of itself, and what its flags and its length say.
bool is_consistent(const EventHeader& header) noexcept {
  switch (header.kind) {
    case EventKind::kSample:
    case EventKind::kAgain:
      return !header.is_deactivated && header.type_revision != 0;
    case EventKind::kSignal:
    case EventKind::kWithheld:
    case EventKind::kUnsent:
      return !header.is_deactivated && header.length == 0;
    case EventKind::kDeactivation:
      return header.is_deactivated && header.length == 0;
    case EventKind::kState:
      return header.length == 0;
  }
  return false;
}

}  // namespace

std::uint64_t EventHeader::token_of(Incarnation importer) const noexcept {
  for (const NamedToken& token : tokens) {
    if (token.importer == importer) return token.number;
  }
  return 0;
}

std::size_t header_bytes(const EventHeader& header) noexcept {
  return kFixedHeaderBytes + header.tokens.size() * kTokenBytes;
}

void write_header(const EventHeader& header, WritableBytes to) noexcept {
  std::byte* at = to.data();
  put(at, kEventMagic);
  put(at + 4, kEventVersion);
  put(at + 5, static_cast<std::uint8_t>(header.kind));
  put(at + 6, header.is_deactivated ? kDeactivatedFlag : std::uint16_t{0});
  put(at + 8, header.exporter);
  put(at + 16, header.number);
  put(at + 24, header.sequence);
  put(at + 32, header.type_revision);
  put(at + 36, header.length);
  put(at + 40, static_cast<std::uint16_t>(header.tokens.size()));
  put(at + 42, std::uint16_t{0});
  at += kFixedHeaderBytes;
  for (const NamedToken& token : header.tokens) {
    put(at, token.importer);
    put(at + 8, token.number);
    at += kTokenBytes;
  }
}

bool read_header(Bytes beginning, std::size_t size, EventHeader& header) {
  header.tokens.clear();
  if (beginning.size() < kFixedHeaderBytes || beginning.size() > size) return false;
  const std::byte* at = beginning.data();
  if (get<std::uint32_t>(at) != kEventMagic || get<std::uint8_t>(at + 4) != kEventVersion) {
    return false;
  }
  const auto flags = get<std::uint16_t>(at + 6);
  if ((flags & ~kDeactivatedFlag) != 0 || get<std::uint16_t>(at + 42) != 0) return false;
  header.kind = static_cast<EventKind>(get<std::uint8_t>(at + 5));
  header.is_deactivated = flags != 0;
  header.exporter = get<std::uint64_t>(at + 8);
  header.number = get<std::uint64_t>(at + 16);
  header.sequence = get<std::uint64_t>(at + 24);
  header.type_revision = get<std::uint32_t>(at + 32);
  header.length = get<std::uint32_t>(at + 36);
  const auto tokens = std::size_t{get<std::uint16_t>(at + 40)};
  if (header.exporter == 0 || header.number == 0 || !is_consistent(header)) return false;
  if (tokens > kMaxImporters || header.length > kMaxSampleBytes) return false;
  const std::size_t before_sample = kFixedHeaderBytes + tokens * kTokenBytes;
  if (beginning.size() < before_sample || size - before_sample < header.length) return false;
  at += kFixedHeaderBytes;
  for (std::size_t i = 0; i < tokens; ++i, at += kTokenBytes) {
    header.tokens.push_back({get<std::uint64_t>(at), get<std::uint64_t>(at + 8)});
  }
  return true;
}

}  // namespace arbiter::link
