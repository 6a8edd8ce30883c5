#include <string>

#include "recording/compression.hpp"
#include "recording/crc32.hpp"
#include "recording/mcap_chunk.hpp"
#include "recording/message_index.hpp"
#include "recording/records.hpp"

namespace arbiter::recording {

struct McapChunkBuilder::Open {
  explicit Open(Compression compression) : compressor(compression) {}

  Compressor compressor;
  std::string records;
  MessageIndex index;
};

McapChunkBuilder::McapChunkBuilder(Compression compression)
    : open_(std::make_unique<Open>(compression)) {}
McapChunkBuilder::McapChunkBuilder(McapChunkBuilder&&) noexcept = default;
McapChunkBuilder& McapChunkBuilder::operator=(McapChunkBuilder&&) noexcept = default;
McapChunkBuilder::~McapChunkBuilder() = default;

void McapChunkBuilder::write(const McapMessage& message) {
  open_->index.add(message, open_->records.size());
  append_message(open_->records, message);
}

bool McapChunkBuilder::is_empty() const noexcept { return open_->records.empty(); }

std::size_t McapChunkBuilder::bytes() const noexcept { return open_->records.size(); }

McapChunk McapChunkBuilder::close() {
  const std::string& records = open_->records;
  McapChunk chunk;
  std::string compressed = open_->compressor.compress(records);
  chunk.compression = open_->compressor.kind();
  // What does not become smaller is not worth the time that decompressing takes.
  if (compressed.size() >= records.size()) {
    chunk.compression = Compression::none;
    compressed = records;
  }
  chunk.uncompressed = records.size();
  chunk.compressed = compressed.size();
  chunk.begin = open_->index.begin();
  chunk.end = open_->index.end();
  std::string head;
  append(head, chunk.begin);
  append(head, chunk.end);
  append(head, chunk.uncompressed);
  append(head, crc32(records));
  append_string(head, name_of(chunk.compression));
  append(head, chunk.compressed);
  chunk.bytes.reserve(kHeadBytes + head.size() + compressed.size() + open_->index.bytes());
  append(chunk.bytes, static_cast<std::uint8_t>(Opcode::chunk));
  append<std::uint64_t>(chunk.bytes, head.size() + compressed.size());
  chunk.bytes += head;
  chunk.bytes += compressed;
  chunk.chunk_bytes = chunk.bytes.size();
  chunk.channels = open_->index.append_to(chunk.bytes);
  open_->records.clear();
  open_->index = {};
  return chunk;
}

}  // namespace arbiter::recording
