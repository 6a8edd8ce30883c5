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
// The disk is full, or a quota is reached.
class NoRoomError : public McapError {
 public:
  using McapError::McapError;
};

using McapTime = std::uint64_t;
// Called often, so that whoever waits can be shown how far it is: `done` of `all`, in bytes of the
// file unless something else is said. Empty: nobody waits.
using Watch = std::function<void(std::uint64_t done, std::uint64_t all)>;
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

// What one record of a file may have, for a reader need not have more memory.
inline constexpr std::size_t kMaxChunkBytes = std::size_t{256} << 20;
// What one message, or one attachment, may have: there is room for the head of its chunk.
inline constexpr std::size_t kMaxMessageBytes = kMaxChunkBytes - 4'096;
// What all schemas and channels of a file may take of its memory: it keeps them.
inline constexpr std::size_t kMaxDeclaredBytes = std::size_t{64} << 20;

// A chunk that is made apart from the file: recording/mcap_chunk.hpp.
struct McapChunk;

// What becomes of a file that cannot be written to its end.
enum class Unfinished : std::uint8_t { keep, discard };

struct McapOptions {
  Compression compression = Compression::zstd;
  std::size_t chunk_bytes = std::size_t{1} << 20;  // a chunk is closed when it has as many
  Unfinished unfinished = Unfinished::keep;
};

// Writes a file from its first byte to its last. What a chunk has that was closed is in the file,
// and is read again after a kill; sync() says when a power cut cannot take it either.
//
// If the file cannot be written (no space is left, or its disk fails), the function throws
// McapError, and so does each later one. The file then ends with the last chunk that was written
// whole, as after a kill; or it is deleted (Unfinished::discard). A program that may meet a limit
// to the size of files must ignore SIGXFSZ. What read_mcap() would not read is refused without such
// consequences: a message or an attachment of more than kMaxMessageBytes, or more than
// kMaxDeclaredBytes of schemas and channels.
class McapWriter {
 public:
  // Makes the file, for its user alone; one that is there already is an error.
  McapWriter(const std::string& path, std::string_view library, const McapOptions& options);
  McapWriter(McapWriter&&) noexcept;
  McapWriter& operator=(McapWriter&&) noexcept;
  // Without close() the file has neither summary nor footer: as after a kill.
  ~McapWriter();

  // Identifiers begin at 1.
  std::uint16_t add_schema(const McapSchema& schema);
  std::uint16_t add_channel(const McapChannel& channel);
  void write(const McapMessage& message);
  // Writes the chunk, which has only messages of channels that were added here: what a flight
  // recorder kept. Each of the following closes the open chunk first, so that what was written
  // before comes before.
  void append(const McapChunk& chunk);
  void write_metadata(const std::string& name, const McapMap& metadata);
  void write_attachment(const McapAttachment& attachment);

  void end_chunk();
  void sync();
  // Summary, indexes, statistics, footer; returns when a power cut cannot take the file.
  void close();
  // Of the file, with the chunk that is not written yet, uncompressed.
  [[nodiscard]] std::uint64_t bytes() const noexcept;

 private:
  struct File;
  std::unique_ptr<File> file_;
};

// A chunk of a file, before its messages.
struct McapChunkInfo {
  std::uint64_t offset = 0;  // in the file
  std::string compression;   // "" for none, "lz4", "zstd"
  std::uint64_t compressed = 0;
  std::uint64_t uncompressed = 0;
};

// What a file has, in its order. A function that is empty is not called. A message comes after its
// channel, and a channel after its schema, each again as often as the file has it. The bytes of a
// message are there until the function returns.
struct McapVisitor {
  std::function<void(std::uint16_t id, const McapSchema&)> schema{};
  std::function<void(std::uint16_t id, const McapChannel&)> channel{};
  std::function<void(const McapMessage&)> message{};
  std::function<void(const std::string& name, const McapMap&)> metadata{};
  std::function<void(const McapAttachment&)> attachment{};
  std::function<void(const std::string& profile, const std::string& library)> header{};
  std::function<void(const McapChunkInfo&)> chunk{};
  Watch watch{};  // before each record
};

struct McapEnd {
  bool is_whole = true;           // else it ends within a record, without a footer, or by damage
  std::uint64_t whole_bytes = 0;  // up to the end of the last record that is whole
  std::string problem{};          // what is wrong behind that, and where; empty: nothing
  bool has_summary = false;       // by which readers find a message without reading all
  std::uint64_t file_bytes = 0;
};

// Reads the data section, one record in memory at a time, and judges each before the visitor sees
// it: its lengths, its CRC, its references to channels and schemas. Damage ends the reading (see
// McapEnd), and so does a record, or a chunk's content, of more than max_chunk_bytes, whatever it
// claims, and schemas and channels of more than kMaxDeclaredBytes: memory stays below a small
// multiple of these. A file that ends early, even within its first bytes, is damaged; one that is
// being written is read as far as it is. Throws for a file that cannot be opened, or begins as no
// MCAP file of this version does.
McapEnd read_mcap(const std::string& path, const McapVisitor& visitor,
                  std::size_t max_chunk_bytes = kMaxChunkBytes);

// Writes to `to`, a new file, what is whole of `from`: its chunks as they are, with indexes, a
// summary, and a metadata record "repaired" that says what was lost, and by which `library` it was
// repaired. Returns how `from` ends.
McapEnd repair_mcap(const std::string& from, const std::string& to, std::string_view library,
                    std::size_t max_chunk_bytes = kMaxChunkBytes, const Watch& watch = {});

}  // namespace arbiter::recording
