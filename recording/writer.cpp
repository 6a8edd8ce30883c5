#include <limits>
#include <string>
#include <utility>

#include "recording/declarations.hpp"
#include "recording/mcap.hpp"
#include "recording/mcap_chunk.hpp"
#include "recording/output_file.hpp"
#include "recording/records.hpp"
#include "recording/summary.hpp"

namespace arbiter::recording {

struct McapWriter::File {
  File(const std::string& path, const McapOptions& chosen)
      : options(chosen), chunk(chosen.compression), out(path, chosen.unfinished) {}

  std::uint16_t id_after(std::size_t count, const char* what) const {
    if (count >= std::numeric_limits<std::uint16_t>::max()) {
      out.refuse(std::string("add a ") + what, "it has 65535, and there can be no more");
    }
    return static_cast<std::uint16_t>(count + 1);
  }

  void require_readable(std::size_t bytes, const char* what,
                        std::size_t most = kMaxMessageBytes) const {
    if (bytes <= most) return;
    out.refuse(std::string("write ") + what, std::to_string(bytes) + " bytes are more than the " +
                                                 std::to_string(most) +
                                                 " that readers are ready for");
  }

  void declare(const std::string& record, const McapMap& metadata) {
    const std::size_t bytes = declared_bytes + Declarations::cost_of(record.size(), metadata);
    require_readable(bytes, "more schemas and channels", kMaxDeclaredBytes);
    declared_bytes = bytes;
    declared += record;
  }

  // Schemas and channels stand outside of chunks, before the first chunk that needs them; they are
  // written together with it.
  void write_after_declared(std::string_view bytes) {
    if (declared.empty()) {
      out.write(bytes);
    } else {
      out.write(std::exchange(declared, {}).append(bytes));
    }
  }

  void end_chunk() {
    if (!chunk.is_empty()) append(chunk.close());
  }

  void append(const McapChunk& closed) {
    const std::uint64_t offset = out.bytes() + declared.size();
    write_after_declared(closed.bytes);
    summary.add_chunk(offset, closed);
  }

  McapOptions options;
  McapChunkBuilder chunk;
  OutputFile out;
  Summary summary;
  std::string declared;            // and not written yet
  std::size_t declared_bytes = 0;  // written or not
  std::size_t schemas = 0;
  std::size_t channels = 0;
};

McapWriter::McapWriter(const std::string& path, std::string_view library,
                       const McapOptions& options)
    : file_(std::make_unique<File>(path, options)) {
  std::string beginning(kMagic);
  append_header(beginning, "", library);
  file_->out.write(beginning);
}

McapWriter::McapWriter(McapWriter&&) noexcept = default;
McapWriter& McapWriter::operator=(McapWriter&&) noexcept = default;
McapWriter::~McapWriter() = default;

std::uint16_t McapWriter::add_schema(const McapSchema& schema) {
  const auto id = file_->id_after(file_->schemas, "schema");
  std::string record;
  append_schema(record, id, schema);
  file_->declare(record, {});
  file_->summary.add_schema(id, record);
  ++file_->schemas;
  return id;
}

std::uint16_t McapWriter::add_channel(const McapChannel& channel) {
  if (channel.schema > file_->schemas) {
    file_->out.refuse("add a channel", "there is no schema " + std::to_string(channel.schema));
  }
  const auto id = file_->id_after(file_->channels, "channel");
  std::string record;
  append_channel(record, id, channel);
  file_->declare(record, channel.metadata);
  file_->summary.add_channel(id, record);
  ++file_->channels;
  return id;
}

void McapWriter::write(const McapMessage& message) {
  if (message.channel == 0 || message.channel > file_->channels) {
    file_->out.refuse("write", "there is no channel " + std::to_string(message.channel));
  }
  file_->require_readable(message.data.size(), "a message");
  if (file_->chunk.bytes() + message.data.size() > kMaxMessageBytes) file_->end_chunk();
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
  file_->require_readable(record.size(), "metadata");
  end_chunk();
  const std::uint64_t offset = file_->out.bytes();
  file_->out.write(record);
  file_->summary.add_metadata(offset, record);
}

void McapWriter::write_attachment(const McapAttachment& attachment) {
  file_->require_readable(attachment.data.size(), "an attachment");
  std::string record;
  append_attachment(record, attachment);
  end_chunk();
  const std::uint64_t offset = file_->out.bytes();
  file_->out.write(record);
  file_->summary.add_attachment(offset, record);
}

void McapWriter::end_chunk() {
  file_->end_chunk();
  file_->write_after_declared({});
}

void McapWriter::sync() { file_->out.sync(); }

void McapWriter::close() {
  end_chunk();
  file_->out.write(file_->summary.ending(file_->out.bytes(), file_->out.crc()));
  file_->out.sync();
  file_->out.close();
}

std::uint64_t McapWriter::bytes() const noexcept {
  return file_->out.bytes() + file_->declared.size() + file_->chunk.bytes();
}

}  // namespace arbiter::recording
