#include "recording/records.hpp"

#include <array>

#include "recording/crc32.hpp"

namespace arbiter::recording {
namespace {

constexpr std::uint64_t kMessageHead = 2 + 4 + 8 + 8;

}  // namespace

std::string name_of(Opcode opcode) {
  static constexpr std::array<std::string_view, 16> kNames{
      "",           "header",           "footer",
      "schema",     "channel",          "message",
      "chunk",      "message index",    "chunk index",
      "attachment", "attachment index", "statistics",
      "metadata",   "metadata index",   "summary offset",
      "data end"};
  const auto number = static_cast<std::size_t>(opcode);
  if (number > 0 && number < kNames.size()) return std::string(kNames[number]);
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  return std::string("record of kind 0x") + kDigits[number >> 4] + kDigits[number & 0xF];
}

std::optional<Record> RecordCursor::next() {
  if (bytes_.empty()) return std::nullopt;
  ByteReader head(bytes_);
  const auto opcode = static_cast<Opcode>(head.number<std::uint8_t>());
  const auto length = head.number<std::uint64_t>();
  if (length > head.left()) {
    throw Damage{"the " + name_of(opcode) + " at byte " + std::to_string(offset_) +
                 " within it says that it has " + std::to_string(length) + " bytes, of which " +
                 std::to_string(head.left()) + " are there"};
  }
  const Record record{opcode, offset_, bytes_.substr(0, kHeadBytes + length)};
  bytes_.remove_prefix(record.bytes.size());
  offset_ += record.bytes.size();
  return record;
}

void append_record(std::string& out, Opcode opcode, std::string_view content) {
  append(out, static_cast<std::uint8_t>(opcode));
  append<std::uint64_t>(out, content.size());
  out += content;
}

void append_header(std::string& out, std::string_view profile, std::string_view library) {
  std::string content;
  append_string(content, profile);
  append_string(content, library);
  append_record(out, Opcode::header, content);
}

void append_schema(std::string& out, std::uint16_t id, const McapSchema& schema) {
  std::string content;
  append(content, id);
  append_string(content, schema.name);
  append_string(content, schema.encoding);
  append_string(content, schema.data);
  append_record(out, Opcode::schema, content);
}

void append_channel(std::string& out, std::uint16_t id, const McapChannel& channel) {
  std::string content;
  append(content, id);
  append(content, channel.schema);
  append_string(content, channel.topic);
  append_string(content, channel.message_encoding);
  append_map(content, channel.metadata);
  append_record(out, Opcode::channel, content);
}

void append_message(std::string& out, const McapMessage& message) {
  append(out, static_cast<std::uint8_t>(Opcode::message));
  append<std::uint64_t>(out, kMessageHead + message.data.size());
  append(out, message.channel);
  append(out, message.sequence);
  append(out, message.log_time);
  append(out, message.publish_time);
  if (!message.data.empty()) {
    out.append(reinterpret_cast<const char*>(message.data.data()), message.data.size());
  }
}

void append_metadata(std::string& out, const std::string& name, const McapMap& metadata) {
  std::string content;
  append_string(content, name);
  append_map(content, metadata);
  append_record(out, Opcode::metadata, content);
}

void append_attachment(std::string& out, const McapAttachment& attachment) {
  std::string content;
  append(content, attachment.log_time);
  append<std::uint64_t>(content, 0);  // when what is attached was made is not known
  append_string(content, attachment.name);
  append_string(content, attachment.media_type);
  append<std::uint64_t>(content, attachment.data.size());
  content += attachment.data;
  append(content, crc32(content));
  append_record(out, Opcode::attachment, content);
}

Header read_header(std::string_view content) {
  ByteReader reader(content);
  Header header;
  header.profile = reader.string();
  header.library = reader.string();
  return header;
}

std::pair<std::uint16_t, McapSchema> read_schema(std::string_view content) {
  ByteReader reader(content);
  const auto id = reader.number<std::uint16_t>();
  McapSchema schema;
  schema.name = reader.string();
  schema.encoding = reader.string();
  schema.data = reader.string();
  return {id, std::move(schema)};
}

std::pair<std::uint16_t, McapChannel> read_channel(std::string_view content) {
  ByteReader reader(content);
  const auto id = reader.number<std::uint16_t>();
  McapChannel channel;
  channel.schema = reader.number<std::uint16_t>();
  channel.topic = reader.string();
  channel.message_encoding = reader.string();
  channel.metadata = reader.map();
  return {id, std::move(channel)};
}

McapMessage read_message(std::string_view content) {
  ByteReader reader(content);
  McapMessage message;
  message.channel = reader.number<std::uint16_t>();
  message.sequence = reader.number<std::uint32_t>();
  message.log_time = reader.number<std::uint64_t>();
  message.publish_time = reader.number<std::uint64_t>();
  const std::string_view data = reader.bytes(reader.left());
  message.data = {reinterpret_cast<const std::byte*>(data.data()), data.size()};
  return message;
}

ChunkHead read_chunk_head(std::string_view content) {
  ByteReader reader(content);
  ChunkHead head;
  head.begin = reader.number<std::uint64_t>();
  head.end = reader.number<std::uint64_t>();
  head.bytes = reader.number<std::uint64_t>();
  head.crc = reader.number<std::uint32_t>();
  head.compression = reader.string();
  head.records = reader.bytes(reader.number<std::uint64_t>());
  return head;
}

std::pair<std::string, McapMap> read_metadata(std::string_view content) {
  ByteReader reader(content);
  std::string name(reader.string());
  return {std::move(name), reader.map()};
}

AttachmentRecord read_attachment(std::string_view content) {
  ByteReader reader(content);
  AttachmentRecord result;
  result.attachment.log_time = reader.number<std::uint64_t>();
  result.create_time = reader.number<std::uint64_t>();
  result.attachment.name = reader.string();
  result.attachment.media_type = reader.string();
  result.attachment.data = reader.bytes(reader.number<std::uint64_t>());
  const std::size_t covered = content.size() - reader.left();
  const auto crc = reader.number<std::uint32_t>();
  if (crc != 0 && crc != crc32(content.substr(0, covered))) {
    throw Damage{"its content does not have the CRC that it says"};
  }
  return result;
}

}  // namespace arbiter::recording
