// Where the messages of a chunk are: what stands behind it in the file, a record for each channel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "recording/mcap.hpp"
#include "recording/mcap_chunk.hpp"

namespace arbiter::recording {

class MessageIndex {
 public:
  // `at`: where its record begins in the records of its chunk. Throws McapError where there are too
  // many.
  void add(const McapMessage& message, std::uint64_t at);

  // Of the log times; 0 without messages.
  [[nodiscard]] McapTime begin() const noexcept { return begin_; }
  [[nodiscard]] McapTime end() const noexcept { return end_; }
  // Of the records that append_to() appends.
  [[nodiscard]] std::size_t bytes() const noexcept;
  std::map<std::uint16_t, McapChunk::Channel> append_to(std::string& out) const;

 private:
  std::map<std::uint16_t, std::vector<std::pair<McapTime, std::uint64_t>>> channels_;
  std::size_t count_ = 0;
  McapTime begin_ = 0;
  McapTime end_ = 0;
};

}  // namespace arbiter::recording
