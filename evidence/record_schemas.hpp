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

// Payloads have channels of their own: the topic is the source, the schema's name its type.
inline constexpr std::string_view kPayloadEncoding = "x-arbiter-bytes";
// Of the metadata record that each recording begins with.
inline constexpr std::string_view kMetadataName = "arbiter.recording";
inline constexpr std::string_view kFormat = "1";
// Of the metadata record that each whole recording ends with.
inline constexpr std::string_view kEndName = "arbiter.end";

}  // namespace arbiter::evidence
