// A chunk of iceoryx as a sample of Arbiter: its user header, if the mapping says that it has one,
// and behind it, aligned, its payload.
#pragma once

#include <algorithm>
#include <cstring>
#include <string>

#include <iceoryx_posh/mepoo/chunk_header.hpp>

#include "gateway/core/incoming.hpp"
#include "gateway/mapping/mapping.hpp"

namespace arbiter::gateway {

class Chunk final : public ForeignSample {
 public:
  Chunk(const void* payload, const IceoryxTopic& topic) noexcept
      : payload_(static_cast<const std::byte*>(payload)),
        header_(*iox::mepoo::ChunkHeader::fromUserPayload(payload)),
        header_size_(topic.user_header),
        begin_(topic.padded_header()),
        // Read once: whoever has sent it could change it.
        payload_size_(header_.userPayloadSize()) {}

  // Empty: its user header is as the mapping says.
  [[nodiscard]] bool has_right_header() const noexcept {
    return header_.userHeaderSize() == header_size_;
  }
  [[nodiscard]] std::uint32_t header_size() const noexcept { return header_.userHeaderSize(); }

  [[nodiscard]] std::size_t size() const noexcept override { return begin_ + payload_size_; }
  [[nodiscard]] std::size_t data_begin() const noexcept override { return begin_; }
  [[nodiscard]] bool copy(std::size_t from, WritableBytes to) const noexcept override {
    std::byte* out = to.data();
    std::size_t left = to.size();
    if (from < header_size_ && left != 0) {
      const std::size_t part = std::min(left, header_size_ - from);
      std::memcpy(out, static_cast<const std::byte*>(header_.userHeader()) + from, part);
      out += part;
      from += part;
      left -= part;
    }
    if (from < begin_ && left != 0) {  // padding
      const std::size_t part = std::min(left, begin_ - from);
      std::memset(out, 0, part);
      out += part;
      from += part;
      left -= part;
    }
    if (left != 0) std::memcpy(out, payload_ + (from - begin_), left);
    return true;
  }

 private:
  const std::byte* const payload_;
  const iox::mepoo::ChunkHeader& header_;
  const std::size_t header_size_;
  const std::size_t begin_;
  const std::uint32_t payload_size_;
};

}  // namespace arbiter::gateway
