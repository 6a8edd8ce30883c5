#include "recording/message_index.hpp"

#include <algorithm>
#include <limits>

#include "recording/records.hpp"

namespace arbiter::recording {
namespace {

constexpr std::size_t kEntryBytes = 8 + 8;
constexpr std::size_t kEmptyBytes = kHeadBytes + 2 + 4;

}  // namespace

void MessageIndex::add(const McapMessage& message, std::uint64_t at) {
  const bool is_first = channels_.empty();
  auto& entries = channels_[message.channel];
  if (entries.size() >= std::numeric_limits<std::uint32_t>::max() / kEntryBytes) {
    throw McapError("a chunk has too many messages for its index: make chunks smaller");
  }
  entries.emplace_back(message.log_time, at);
  begin_ = is_first ? message.log_time : std::min(begin_, message.log_time);
  end_ = is_first ? message.log_time : std::max(end_, message.log_time);
}

std::size_t MessageIndex::bytes() const noexcept {
  std::size_t bytes = 0;
  for (const auto& [channel, entries] : channels_) {
    bytes += kEmptyBytes + entries.size() * kEntryBytes;
  }
  return bytes;
}

std::map<std::uint16_t, McapChunk::Channel> MessageIndex::append_to(std::string& out) const {
  std::map<std::uint16_t, McapChunk::Channel> places;
  for (const auto& [channel, entries] : channels_) {
    places[channel] = {entries.size(), out.size()};
    append(out, static_cast<std::uint8_t>(Opcode::message_index));
    append<std::uint64_t>(out, kEmptyBytes - kHeadBytes + entries.size() * kEntryBytes);
    append(out, channel);
    append(out, static_cast<std::uint32_t>(entries.size() * kEntryBytes));
    for (const auto& [time, at] : entries) {
      append(out, time);
      append(out, at);
    }
  }
  return places;
}

}  // namespace arbiter::recording
