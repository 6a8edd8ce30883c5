#include "recording/declarations.hpp"

#include "recording/crc32.hpp"

namespace arbiter::recording {

std::size_t Declarations::cost_of(std::size_t record_bytes, const McapMap& metadata) {
  // Two empty strings and a node of the map, of which the file has eight bytes.
  constexpr std::size_t kEntry = 128;
  return record_bytes + metadata.size() * kEntry;
}

void Declarations::declare(Known& known, std::uint16_t id, const Record& record,
                           const McapMap& metadata) {
  const Content content{record.bytes.size(), crc32(record.content())};
  const auto [place, is_new] = known.emplace(id, content);
  if (!is_new && place->second != content) {
    throw Damage{"it differs from an earlier " + name_of(record.opcode) + " with the number " +
                 std::to_string(id)};
  }
  if (!is_new) return;
  bytes_ += cost_of(content.bytes, metadata);
  if (bytes_ > max_bytes_) {
    throw Damage{"with it, the schemas and channels take more than " + std::to_string(max_bytes_) +
                 " bytes of memory, which is more than this program gives them"};
  }
}

void Declarations::judge(const Record& record) {
  if (record.opcode == Opcode::schema) {
    const auto [id, schema] = read_schema(record.content());
    if (id != 0) declare(schemas_, id, record, {});  // else it is nobody's
  } else if (record.opcode == Opcode::channel) {
    const auto [id, channel] = read_channel(record.content());
    if (channel.schema != 0 && schemas_.count(channel.schema) == 0) {
      throw Damage{"there is no schema " + std::to_string(channel.schema) + " for its channel " +
                   std::to_string(id)};
    }
    declare(channels_, id, record, channel.metadata);
  } else if (record.opcode == Opcode::message) {
    const std::uint16_t channel = read_message(record.content()).channel;
    if (channels_.count(channel) == 0) {
      throw Damage{"there is no channel " + std::to_string(channel) + " for its message"};
    }
  }
}

}  // namespace arbiter::recording
