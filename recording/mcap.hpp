// MCAP files, as far as recordings need them: version 0 of the format of https://mcap.dev/spec.
// Nothing here knows what is recorded.
//
// Threads: one at a time. Times are nanoseconds of whatever clock the caller has. Errors:
// McapError.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace arbiter::recording {

// Cannot be written, or read: says which file, at which byte, why, and what to do.
class McapError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

using McapTime = std::uint64_t;
using McapMap = std::map<std::string, std::string>;

enum class Compression : std::uint8_t { none, lz4, zstd };

struct McapSchema {
  std::string name;
  std::string encoding;  // "jsonschema"; empty: none
  std::string data;
};

struct McapChannel {
  std::uint16_t schema = 0;  // 0: none
  std::string topic;
  std::string message_encoding;  // "json"
  McapMap metadata;
};

struct McapMessage {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  McapTime log_time = 0;
  McapTime publish_time = 0;
  std::span<const std::byte> data{};
};

struct McapAttachment {
  std::string name;
  std::string media_type;
  McapTime log_time = 0;
  std::string data;
};

struct McapOptions {
  Compression compression = Compression::zstd;
  std::size_t chunk_bytes = std::size_t{1} << 20;  // a chunk is closed when it has as many
};

// Writes a file from its first byte to its last. What a chunk has that was closed is in the file,
// and is read again after a kill; sync() says when a power cut cannot take it either.
class McapWriter {
 public:
  // Makes the file; one that is there already is an error.
  McapWriter(const std::string& path, std::string_view library, const McapOptions& options);
  McapWriter(McapWriter&&) noexcept;
  McapWriter& operator=(McapWriter&&) noexcept;
  // Without close() the file has neither summary nor footer: as after a kill.
  ~McapWriter();

  // Identifiers begin at 1.
  std::uint16_t add_schema(const McapSchema& schema);
  std::uint16_t add_channel(const McapChannel& channel);
  void write(const McapMessage& message);
  // Closes the chunk first, so that what was written before comes before.
  void write_metadata(const std::string& name, const McapMap& metadata);
  void write_attachment(const McapAttachment& attachment);

  void end_chunk();
  void sync();
  // Summary, indexes, statistics, footer.
  void close();
  // Of the file, with the chunk that is not written yet, uncompressed.
  [[nodiscard]] std::uint64_t bytes() const noexcept;

 private:
  struct File;
  std::unique_ptr<File> file_;
};

// What a file has, in its order. A function that is empty is not called.
struct McapVisitor {
  std::function<void(std::uint16_t id, const McapSchema&)> schema{};
  std::function<void(std::uint16_t id, const McapChannel&)> channel{};
  std::function<void(const McapMessage&)> message{};
  std::function<void(const std::string& name, const McapMap&)> metadata{};
  std::function<void(const McapAttachment&)> attachment{};
};

struct McapEnd {
  bool is_whole = true;           // else it ends within a record, without a footer, or by damage
  std::uint64_t whole_bytes = 0;  // up to the end of the last record that is whole
  std::string problem{};          // what is wrong behind that, and where; empty: nothing
};

// Reads the data section, one chunk in memory at a time. Judges each length before it is used: what
// a file claims never takes more memory than max_chunk_bytes. Throws for a file that cannot be
// opened or is no MCAP file; damage ends the reading and is told.
McapEnd read_mcap(const std::string& path, const McapVisitor& visitor,
                  std::size_t max_chunk_bytes = std::size_t{256} << 20);

// Writes to `to` what is whole of `from`, with a summary.
McapEnd repair_mcap(const std::string& from, const std::string& to, std::string_view library);

}  // namespace arbiter::recording
