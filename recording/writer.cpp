#include <limits>
#include <map>
#include <utility>

#include "recording/mcap.hpp"
#include "recording/mcap_chunk.hpp"
#include "recording/output_file.hpp"
#include "recording/records.hpp"
#include "recording/summary.hpp"

namespace arbiter::recording {

struct McapWriter::File {
  File(const std::string& path, const McapOptions& chosen)
      : options(chosen), chunk(chosen.compression), out(path, Unfinished::keep) {}

  template <typename Id>
  static Id next_id(std::size_t count, const OutputFile& out, const char* what) {
    if (count >= std::numeric_limits<Id>::max()) {
      out.refuse(std::string("add a ") + what, "it has 65535, and there can be no more");
    }
    return static_cast<Id>(count + 1);
  }

  // Schemas and channels stand outside of chunks, before the first chunk that needs them; they are
  // written together with it.
  void write_declared(std::string_view what) {
    const std::string bytes = std::exchange(declared, {}) + std::string(what);
    if (!bytes.empty()) out.write(bytes);
  }

  void end_chunk() {
    if (!chunk.is_empty()) append(chunk.close());
  }

  void append(const McapChunk& closed) {
    const std::uint64_t offset = out.bytes() + declared.size();
    write_declared(closed.bytes);
    summary.add_chunk(offset, closed);
  }

  McapOptions options;
  McapChunkBuilder chunk;
  OutputFile out;
  Summary summary;
  std::string declared;
  std::size_t schemas = 0;
  std::size_t channels = 0;
};

McapWriter::McapWriter(const std::string& path, std::string_view library,
                       const McapOptions& options)
    : file_(std::make_unique<File>(path, options)) {
  std::string beginning(kMagic);
  append_header(beginning, "", library);
  try {
    file_->out.write(beginning);
  } catch (const McapError&) {
    file_->out.discard();  // it would be in the way of the next attempt
    throw;
  }
}

McapWriter::McapWriter(McapWriter&&) noexcept = default;
McapWriter& McapWriter::operator=(McapWriter&&) noexcept = default;
McapWriter::~McapWriter() = default;

std::uint16_t McapWriter::add_schema(const McapSchema& schema) {
  const auto id = File::next_id<std::uint16_t>(file_->schemas, file_->out, "schema");
  std::string record;
  append_schema(record, id, schema);
  file_->summary.add_schema(id, record);
  file_->declared += record;
  ++file_->schemas;
  return id;
}

std::uint16_t McapWriter::add_channel(const McapChannel& channel) {
  if (channel.schema > file_->schemas) {
    file_->out.refuse("add a channel", "there is no schema " + std::to_string(channel.schema));
  }
  const auto id = File::next_id<std::uint16_t>(file_->channels, file_->out, "channel");
  std::string record;
  append_channel(record, id, channel);
  file_->summary.add_channel(id, record);
  file_->declared += record;
  ++file_->channels;
  return id;
}

void McapWriter::write(const McapMessage& message) {
  if (message.channel == 0 || message.channel > file_->channels) {
    file_->out.refuse("write", "there is no channel " + std::to_string(message.channel));
  }
  file_->chunk.write(message);
  if (file_->chunk.bytes() >= file_->options.chunk_bytes) file_->end_chunk();
}

void McapWriter::append(const McapChunk& chunk) {
  if (!chunk.channels.empty() &&
      (chunk.channels.begin()->first == 0 || chunk.channels.rbegin()->first > file_->channels)) {
    file_->out.refuse("append a chunk", "it has messages of a channel that was not added");
  }
  file_->end_chunk();
  file_->append(chunk);
}

void McapWriter::write_metadata(const std::string& name, const McapMap& metadata) {
  std::string record;
  append_metadata(record, name, metadata);
  end_chunk();
  const std::uint64_t offset = file_->out.bytes();
  file_->out.write(record);
  file_->summary.add_metadata(offset, record);
}

void McapWriter::write_attachment(const McapAttachment& attachment) {
  std::string record;
  append_attachment(record, attachment);
  end_chunk();
  const std::uint64_t offset = file_->out.bytes();
  file_->out.write(record);
  file_->summary.add_attachment(offset, record);
}

void McapWriter::end_chunk() {
  file_->end_chunk();
  file_->write_declared({});
}

void McapWriter::sync() { file_->out.sync(); }

void McapWriter::close() {
  end_chunk();
  file_->out.write(file_->summary.ending(file_->out.bytes(), file_->out.crc()));
  file_->out.close();
}

std::uint64_t McapWriter::bytes() const noexcept {
  return file_->out.bytes() + file_->declared.size() + file_->chunk.bytes();
}

}  // namespace arbiter::recording
