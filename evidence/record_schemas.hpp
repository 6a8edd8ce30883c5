// The kinds of records in a file: their topics and their JSON Schemas.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace arbiter::evidence {

enum class RecordKind : std::uint8_t {
  kStart,
  kArrival,
  kDeactivation,
  kState,
  kDestinations,
  kPort,
  kModel,
  kWinner,
  kMissed,
};
inline constexpr std::size_t kRecordKinds = 9;

struct RecordSchema {
  std::string_view topic;
  std::string_view name;
  std::string_view properties;  // name:type, separated by blanks; the test reads the whole
  [[nodiscard]] std::string json() const;
};

extern const std::array<RecordSchema, kRecordKinds> record_schemas;  // by kind

// What a record may have, for what parsing makes of its text may be many times as large: a model
// has the texts of its files, the others have at most some lists of destinations.
constexpr std::size_t max_record_bytes(RecordKind kind) {
  return std::size_t{kind == RecordKind::kModel ? 64u : 1u} << 20;
}

// Payloads have channels of their own: the topic is the source, the schema's name its type.
inline constexpr std::string_view kPayloadEncoding = "x-arbiter-bytes";
// Of the metadata record that each recording begins with.
inline constexpr std::string_view kMetadataName = "arbiter.recording";
inline constexpr std::string_view kFormat = "1";
// Of the metadata record that each whole recording ends with.
inline constexpr std::string_view kEndName = "arbiter.end";

}  // namespace arbiter::evidence
