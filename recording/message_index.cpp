#include "recording/message_index.hpp"

#include <algorithm>
#include <string>

#include "recording/records.hpp"

namespace arbiter::recording {
namespace {

constexpr std::size_t kEntryBytes = 8 + 8;
// Of one chunk. Compressed, more of them may take a file little; but readers that look for messages
// by their index refuse a chunk without it.
constexpr std::size_t kMostMessages = std::size_t{1} << 20;
constexpr std::size_t kEmptyBytes = kHeadBytes + 2 + 4;

}  // namespace

void MessageIndex::add(const McapMessage& message, std::uint64_t at) {
  if (count_ >= kMostMessages) {
    throw McapError("a chunk has more than " + std::to_string(kMostMessages) +
                    " messages, which is too many for its index");
  }
  const bool is_first = count_++ == 0;
  channels_[message.channel].emplace_back(message.log_time, at);
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
