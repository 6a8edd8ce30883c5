// The records of MCAP, each as it is written: an opcode, a length of 64 bits, the content.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "recording/bytes.hpp"
#include "recording/mcap.hpp"

namespace arbiter::recording {

// The file's first and last bytes; the fifth is the version.
inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::size_t kHeadBytes = 9;  // of each record: its opcode and length

enum class Opcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  attachment = 0x09,
  attachment_index = 0x0A,
  statistics = 0x0B,
  metadata = 0x0C,
  metadata_index = 0x0D,
  summary_offset = 0x0E,
  data_end = 0x0F,
};

// For messages: "chunk"; "record of kind 0x81" where this program does not know it.
[[nodiscard]] std::string name_of(Opcode opcode);

// One that is whole. The bytes are another's.
struct Record {
  Opcode opcode{};
  std::uint64_t offset = 0;  // in the file, or in the records of its chunk
  std::string_view bytes;

  [[nodiscard]] std::string_view content() const { return bytes.substr(kHeadBytes); }
};

// The records in `bytes` one after the other. Throws Damage at one that is not whole.
class RecordCursor {
 public:
  explicit RecordCursor(std::string_view bytes) noexcept : bytes_(bytes) {}
  [[nodiscard]] std::optional<Record> next();

 private:
  std::string_view bytes_;
  std::uint64_t offset_ = 0;
};

void append_record(std::string& out, Opcode opcode, std::string_view content);

void append_header(std::string& out, std::string_view profile, std::string_view library);
void append_schema(std::string& out, std::uint16_t id, const McapSchema& schema);
void append_channel(std::string& out, std::uint16_t id, const McapChannel& channel);
void append_message(std::string& out, const McapMessage& message);
void append_metadata(std::string& out, const std::string& name, const McapMap& metadata);
void append_attachment(std::string& out, const McapAttachment& attachment);

struct Header {
  std::string_view profile;
  std::string_view library;
};

struct ChunkHead {
  McapTime begin = 0;
  McapTime end = 0;
  std::uint64_t bytes = 0;  // uncompressed
  std::uint32_t crc = 0;    // of these; 0: not given
  std::string_view compression;
  std::string_view records;  // compressed
};

// What the index of attachments needs, too.
struct AttachmentRecord {
  McapAttachment attachment;
  McapTime create_time = 0;
};

// Throw Damage.
[[nodiscard]] Header read_header(std::string_view content);
[[nodiscard]] std::pair<std::uint16_t, McapSchema> read_schema(std::string_view content);
[[nodiscard]] std::pair<std::uint16_t, McapChannel> read_channel(std::string_view content);
[[nodiscard]] McapMessage read_message(std::string_view content);
[[nodiscard]] ChunkHead read_chunk_head(std::string_view content);
[[nodiscard]] std::pair<std::string, McapMap> read_metadata(std::string_view content);
[[nodiscard]] AttachmentRecord read_attachment(std::string_view content);

}  // namespace arbiter::recording
