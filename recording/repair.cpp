#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "recording/compression.hpp"
#include "recording/mcap.hpp"
#include "recording/mcap_chunk.hpp"
#include "recording/message_index.hpp"
#include "recording/output_file.hpp"
#include "recording/records.hpp"
#include "recording/summary.hpp"
#include "recording/walk.hpp"

namespace arbiter::recording {
namespace {

// The records as they are, but for the indexes behind chunks, which may be cut off or damaged, and
// are made from the chunks.
class Copy {
 public:
  Copy(std::string from, OutputFile& out) : from_(std::move(from)), out_(out) {
    out_.write(kMagic);
  }

  void add(const Record& record, std::string_view records) {
    const std::uint64_t offset = out_.bytes();
    switch (record.opcode) {
      case Opcode::chunk:
        add_chunk(record, records);
        return;
      case Opcode::message_index:
        return;
      case Opcode::metadata:
        summary_.add_metadata(offset, record.bytes);
        break;
      case Opcode::attachment:
        summary_.add_attachment(offset, record.bytes);
        break;
      default:
        add_declared(record);
        break;
    }
    out_.write(record.bytes);
  }

  void add_metadata(const std::string& name, const McapMap& metadata) {
    std::string record;
    append_metadata(record, name, metadata);
    summary_.add_metadata(out_.bytes(), record);
    out_.write(record);
  }

  void close() {
    out_.write(summary_.ending(out_.bytes(), out_.crc()));
    out_.sync();
    out_.close();
  }

 private:
  // A message only where it stands outside of a chunk.
  void add_declared(const Record& record) {
    if (record.opcode == Opcode::schema) {
      const std::uint16_t id = read_schema(record.content()).first;
      if (id != 0) summary_.add_schema(id, record.bytes);
    } else if (record.opcode == Opcode::channel) {
      summary_.add_channel(read_channel(record.content()).first, record.bytes);
    } else if (record.opcode == Opcode::message) {
      const McapMessage message = read_message(record.content());
      summary_.add_message(message.channel, message.log_time);
    }
  }

  MessageIndex index_of(const Record& chunk, std::string_view records) {
    MessageIndex index;
    RecordCursor cursor(records);
    try {
      while (const auto inner = cursor.next()) {
        if (inner->opcode == Opcode::message) {
          index.add(read_message(inner->content()), inner->offset);
        } else {
          add_declared(*inner);
        }
      }
    } catch (const McapError& error) {
      throw McapError("cannot repair " + from_ + ": at byte " + std::to_string(chunk.offset) +
                      ", " + error.what());
    }
    return index;
  }

  void add_chunk(const Record& record, std::string_view records) {
    const ChunkHead head = read_chunk_head(record.content());
    const MessageIndex index = index_of(record, records);
    McapChunk chunk;
    chunk.bytes = record.bytes;
    chunk.chunk_bytes = record.bytes.size();
    chunk.compressed = head.records.size();
    chunk.uncompressed = head.bytes;
    chunk.compression = compression_of(head.compression);
    chunk.begin = index.begin();
    chunk.end = index.end();
    chunk.channels = index.append_to(chunk.bytes);
    const std::uint64_t offset = out_.bytes();
    out_.write(chunk.bytes);
    summary_.add_chunk(offset, chunk);
  }

  const std::string from_;
  OutputFile& out_;
  Summary summary_;
};

McapMap account_of(const McapEnd& end, std::string_view library) {
  McapMap account{{"by", std::string(library)}};
  if (end.is_whole) return account;
  account["problem"] = end.problem;
  account["lost_bytes"] = std::to_string(end.file_bytes - end.whole_bytes);
  return account;
}

}  // namespace

McapEnd repair_mcap(const std::string& from, const std::string& to, std::string_view library,
                    std::size_t max_chunk_bytes, const Watch& watch) {
  std::optional<OutputFile> out;
  std::optional<Copy> copy;
  const auto on_record = [&](const Record& record, std::string_view records) {
    // All that it has is in `from` as well.
    if (!copy) copy.emplace(from, out.emplace(to, Unfinished::discard));
    copy->add(record, records);
  };
  McapEnd end = walk_mcap(from, max_chunk_bytes, on_record, watch);
  if (!copy) throw McapError("cannot repair " + from + ": nothing of it is whole: " + end.problem);
  copy->add_metadata("repaired", account_of(end, library));
  copy->close();
  return end;
}

}  // namespace arbiter::recording
