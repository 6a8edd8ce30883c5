#include "recording/summary.hpp"

#include <algorithm>
#include <utility>

#include "recording/compression.hpp"
#include "recording/crc32.hpp"

namespace arbiter::recording {
namespace {

std::string concatenate(const std::map<std::uint16_t, std::string>& records) {
  std::string all;
  for (const auto& [id, record] : records) all += record;
  return all;
}

}  // namespace

void Summary::add_schema(std::uint16_t id, std::string_view record) {
  schemas_.emplace(id, record);
}

void Summary::add_channel(std::uint16_t id, std::string_view record) {
  channels_.emplace(id, record);
}

void Summary::add_chunk(std::uint64_t offset, const McapChunk& chunk) {
  std::string index;
  append(index, chunk.begin);
  append(index, chunk.end);
  append(index, offset);
  append(index, chunk.chunk_bytes);
  std::string places;
  std::uint64_t messages = 0;
  for (const auto& [id, channel] : chunk.channels) {
    append(places, id);
    append(places, offset + channel.index_at);
    counts_[id] += channel.messages;
    messages += channel.messages;
  }
  append_string(index, places);
  append<std::uint64_t>(index, chunk.bytes.size() - chunk.chunk_bytes);
  append_string(index, name_of(chunk.compression));
  append(index, chunk.compressed);
  append(index, chunk.uncompressed);
  append_record(chunk_indexes_, Opcode::chunk_index, index);
  ++chunks_;
  if (messages > 0) add_times(chunk.begin, chunk.end);
  messages_ += messages;
}

void Summary::add_message(std::uint16_t channel, McapTime log_time) {
  add_times(log_time, log_time);
  ++messages_;
  ++counts_[channel];
}

void Summary::add_times(McapTime begin, McapTime end) {
  begin_ = messages_ == 0 ? begin : std::min(begin_, begin);
  end_ = messages_ == 0 ? end : std::max(end_, end);
}

void Summary::add_metadata(std::uint64_t offset, std::string_view record) {
  std::string index;
  append(index, offset);
  append<std::uint64_t>(index, record.size());
  append_string(index, ByteReader(record.substr(kHeadBytes)).string());
  append_record(metadata_indexes_, Opcode::metadata_index, index);
  ++metadata_;
}

void Summary::add_attachment(std::uint64_t offset, std::string_view record) {
  ByteReader reader(record.substr(kHeadBytes));
  const auto log_time = reader.number<std::uint64_t>();
  const auto create_time = reader.number<std::uint64_t>();
  const std::string_view name = reader.string();
  const std::string_view media_type = reader.string();
  std::string index;
  append(index, offset);
  append<std::uint64_t>(index, record.size());
  append(index, log_time);
  append(index, create_time);
  append(index, reader.number<std::uint64_t>());
  append_string(index, name);
  append_string(index, media_type);
  append_record(attachment_indexes_, Opcode::attachment_index, index);
  ++attachments_;
}

std::string Summary::statistics() const {
  std::string content;
  append(content, messages_);
  append(content, static_cast<std::uint16_t>(schemas_.size()));
  append(content, static_cast<std::uint32_t>(channels_.size()));
  append(content, attachments_);
  append(content, metadata_);
  append(content, chunks_);
  append(content, begin_);
  append(content, end_);
  std::string counts;
  for (const auto& [id, count] : counts_) {
    append(counts, id);
    append(counts, count);
  }
  append_string(content, counts);
  std::string record;
  append_record(record, Opcode::statistics, content);
  return record;
}

std::string Summary::ending(std::uint64_t offset, std::uint32_t crc) const {
  std::string out;
  std::string content;
  append(content, crc);
  append_record(out, Opcode::data_end, content);
  const std::size_t summary_at = out.size();
  std::string offsets;
  const auto add_group = [&](Opcode opcode, const std::string& records) {
    if (records.empty()) return;
    std::string group;
    append(group, static_cast<std::uint8_t>(opcode));
    append<std::uint64_t>(group, offset + out.size());
    append<std::uint64_t>(group, records.size());
    append_record(offsets, Opcode::summary_offset, group);
    out += records;
  };
  add_group(Opcode::schema, concatenate(schemas_));
  add_group(Opcode::channel, concatenate(channels_));
  add_group(Opcode::statistics, statistics());
  add_group(Opcode::chunk_index, chunk_indexes_);
  add_group(Opcode::attachment_index, attachment_indexes_);
  add_group(Opcode::metadata_index, metadata_indexes_);
  const std::size_t offsets_at = out.size();
  out += offsets;
  // The footer's CRC covers its own beginning.
  append(out, static_cast<std::uint8_t>(Opcode::footer));
  append<std::uint64_t>(out, 8 + 8 + 4);
  append<std::uint64_t>(out, offset + summary_at);
  append<std::uint64_t>(out, offset + offsets_at);
  append(out, crc32(std::string_view(out).substr(summary_at)));
  out += kMagic;
  return out;
}

}  // namespace arbiter::recording
