// The header of each event of a source on the network, and the checks on it.
//
//   0   4  "ARBL"
//   4   1  version, 1
//   5   1  kind (EventKind)
//   6   2  flags: 1, the source is deactivated
//   8   8  incarnation of the exporter's offer, not 0
//  16   8  number of the event in the stream of that offer, from 1
//  24   8  sequence of the sample by its publisher; of other events that of the last one before
//  32   4  revision of the type that the source's samples have, from 1; 0: not known yet
//  36   4  length of the sample behind the header, in bytes
//  40   2  tokens: how many
//  42   2  0
//  44 16n  tokens: incarnation of the importer, number
//   …      the sample
//
// Numbers are little-endian. What follows the sample is padding. A header that is not exactly so is
// refused: no part of it is used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <arbiter/bytes.hpp>

#include "link/core/held_tokens.hpp"

namespace arbiter::link {

enum class EventKind : std::uint8_t {
  kSample = 1,
  kSignal,        // an arrival without a sample
  kDeactivation,  // the source's activity was ended
  kState,         // nothing has happened: what the source is like
  kWithheld,      // an arrival whose sample stays at home (demand.hpp)
  // The sample of the last arrival, which was withheld, with the tokens of that: for importers that
  // have had that event it is no other event. Its number is that of the exporter's last event.
  kAgain,
  kUnsent,  // an arrival whose sample could not be sent, and never will be
};

// Whether there is a sample that the event's sequence counts, be it with it or not.
[[nodiscard]] constexpr bool has_sample(EventKind kind) noexcept {
  return kind == EventKind::kSample || kind == EventKind::kWithheld || kind == EventKind::kAgain ||
         kind == EventKind::kUnsent;
}

// Whether it comes with the event.
[[nodiscard]] constexpr bool brings_sample(EventKind kind) noexcept {
  return kind == EventKind::kSample || kind == EventKind::kAgain;
}

struct EventHeader {
  EventKind kind = EventKind::kState;
  bool is_deactivated = false;
  Incarnation exporter = 0;
  std::uint64_t number = 0;
  std::uint64_t sequence = 0;
  std::uint32_t type_revision = 0;
  std::uint32_t length = 0;
  std::vector<NamedToken> tokens;

  // The token of that importer; 0: there is none.
  [[nodiscard]] std::uint64_t token_of(Incarnation importer) const noexcept;
};

inline constexpr std::size_t kFixedHeaderBytes = 44;
inline constexpr std::size_t kTokenBytes = 16;
inline constexpr std::size_t kMaxHeaderBytes = kFixedHeaderBytes + kMaxImporters * kTokenBytes;
// The largest sample that crosses the network.
inline constexpr std::size_t kMaxSampleBytes = std::size_t{16} << 20;

[[nodiscard]] std::size_t header_bytes(const EventHeader& header) noexcept;
// Into exactly header_bytes(header) bytes. The header is within the bounds above.
void write_header(const EventHeader& header, WritableBytes to) noexcept;

// What has arrived: its beginning, of at most kMaxHeaderBytes, and its size in all. Into `header`,
// whose memory is used again, so that nothing is allocated once it has grown. False: it is no
// event, or one that contradicts itself or the bounds; `header` means nothing then.
[[nodiscard]] bool read_header(Bytes beginning, std::size_t size, EventHeader& header);

}  // namespace arbiter::link
