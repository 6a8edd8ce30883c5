#include <string>
#include <string_view>

#include "recording/mcap.hpp"
#include "recording/records.hpp"
#include "recording/walk.hpp"

namespace arbiter::recording {
namespace {

// Which, in a chunk or outside of one, mean the same.
void visit_declared(const Record& record, const McapVisitor& visitor) {
  if (record.opcode == Opcode::message) {
    if (visitor.message) visitor.message(read_message(record.content()));
  } else if (record.opcode == Opcode::schema && visitor.schema) {
    const auto [id, schema] = read_schema(record.content());
    if (id != 0) visitor.schema(id, schema);
  } else if (record.opcode == Opcode::channel && visitor.channel) {
    const auto [id, channel] = read_channel(record.content());
    visitor.channel(id, channel);
  }
}

void visit_chunk(const Record& record, std::string_view records, const McapVisitor& visitor) {
  if (visitor.chunk) {
    const ChunkHead head = read_chunk_head(record.content());
    visitor.chunk({record.offset, std::string(head.compression), head.records.size(), head.bytes});
  }
  RecordCursor cursor(records);
  while (const auto inner = cursor.next()) visit_declared(*inner, visitor);
}

void visit(const Record& record, std::string_view records, const McapVisitor& visitor) {
  switch (record.opcode) {
    case Opcode::schema:
    case Opcode::channel:
    case Opcode::message:
      visit_declared(record, visitor);
      break;
    case Opcode::chunk:
      visit_chunk(record, records, visitor);
      break;
    case Opcode::metadata:
      if (visitor.metadata) {
        const auto [name, map] = read_metadata(record.content());
        visitor.metadata(name, map);
      }
      break;
    case Opcode::attachment:
      if (visitor.attachment) visitor.attachment(read_attachment(record.content()).attachment);
      break;
    case Opcode::header:
      if (visitor.header) {
        const Header header = read_header(record.content());
        visitor.header(std::string(header.profile), std::string(header.library));
      }
      break;
    default:
      break;
  }
}

}  // namespace

McapEnd read_mcap(const std::string& path, const McapVisitor& visitor,
                  std::size_t max_chunk_bytes) {
  const auto on_record = [&](const Record& record, std::string_view records) {
    visit(record, records, visitor);
  };
  return walk_mcap(path, max_chunk_bytes, on_record, visitor.watch);
}

}  // namespace arbiter::recording
