// A chunk that need not be in a file yet: what keeps the last minutes of a recording in memory
// keeps these, drops the oldest, and appends the others to a file when they are wanted.
//
// Threads: one at a time for each object.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "recording/mcap.hpp"

namespace arbiter::recording {

// As it is written, wherever in the file: nothing in it depends on where it stands.
struct McapChunk {
  struct Channel {
    std::uint64_t messages = 0;
    std::uint64_t index_at = 0;  // in `bytes`
  };

  std::string bytes;              // the chunk record, and behind it the index of each channel
  std::uint64_t chunk_bytes = 0;  // of the chunk record alone
  std::uint64_t compressed = 0;   // of its messages
  std::uint64_t uncompressed = 0;
  Compression compression =
      Compression::none;  // that was asked for, or none where it saves nothing
  McapTime begin = 0;     // of the log times of its messages
  McapTime end = 0;
  std::map<std::uint16_t, Channel> channels;
};

class McapChunkBuilder {
 public:
  explicit McapChunkBuilder(Compression compression);
  McapChunkBuilder(McapChunkBuilder&&) noexcept;
  McapChunkBuilder& operator=(McapChunkBuilder&&) noexcept;
  ~McapChunkBuilder();

  // The schema and the channel are those that the file has, or will have, under these identifiers.
  void write(const McapMessage& message);
  [[nodiscard]] bool is_empty() const noexcept;
  [[nodiscard]] std::size_t bytes() const noexcept;  // uncompressed
  // Compresses what was written, and begins the next chunk.
  [[nodiscard]] McapChunk close();

 private:
  struct Open;
  std::unique_ptr<Open> open_;
};

}  // namespace arbiter::recording
