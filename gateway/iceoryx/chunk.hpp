// A chunk of iceoryx as a sample of Arbiter: its user header, if the mapping says that it has one,
// and behind it, aligned, its payload.
//
// Whoever has sent a chunk may write its header at any time: each field is read once, and nothing
// is read that does not lie in the chunk's segment. What lies there the sender may read, too.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <iceoryx_hoofs/internal/relocatable_pointer/base_relative_pointer.hpp>
#include <iceoryx_posh/mepoo/chunk_header.hpp>

#include "gateway/core/incoming.hpp"
#include "gateway/mapping/mapping.hpp"

namespace arbiter::gateway {

class Chunk final : public ForeignSample {
 public:
  Chunk(const iox::mepoo::ChunkHeader& chunk, const IceoryxTopic& topic) noexcept
      : chunk_(reinterpret_cast<const std::byte*>(&chunk)),
        payload_(static_cast<const std::byte*>(chunk.userPayload())),
        payload_size_(chunk.userPayloadSize()),
        own_header_size_(chunk.userHeaderSize()),
        header_size_(topic.user_header),
        begin_(topic.padded_header()) {}

  // Before anything is copied: all of it lies in the segment.
  [[nodiscard]] bool is_whole() const noexcept {
    return payload_ >= header() + header_size_ && segment_of(chunk_) != 0 &&
           segment_of(payload_ + payload_size_ - 1) == segment_of(chunk_);
  }
  // Its user header is as the mapping says, or empty.
  [[nodiscard]] bool has_right_header() const noexcept { return own_header_size_ == header_size_; }
  [[nodiscard]] std::uint32_t header_size() const noexcept { return own_header_size_; }

  [[nodiscard]] std::size_t size() const noexcept override { return begin_ + payload_size_; }
  [[nodiscard]] std::size_t data_begin() const noexcept override { return begin_; }
  [[nodiscard]] bool copy(std::size_t from, WritableBytes to) const noexcept override {
    std::byte* out = to.data();
    std::size_t left = to.size();
    if (from < header_size_ && left != 0) {
      const std::size_t part = std::min(left, header_size_ - from);
      std::memcpy(out, header() + from, part);
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
  // Where ChunkHeader::userHeader() has it, which reads whether there is one.
  [[nodiscard]] const std::byte* header() const noexcept {
    return chunk_ + sizeof(iox::mepoo::ChunkHeader);
  }
  // 0: of none. Iceoryx knows them from RouDi, in memory of this process's own.
  [[nodiscard]] static std::uint64_t segment_of(const std::byte* place) noexcept {
    return iox::rp::BaseRelativePointer::searchId(const_cast<std::byte*>(place));
  }

  const std::byte* const chunk_;
  const std::byte* const payload_;
  const std::uint32_t payload_size_;
  const std::uint32_t own_header_size_;
  const std::size_t header_size_;
  const std::size_t begin_;
};

}  // namespace arbiter::gateway
