// The schemas and channels that a file has declared so far.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>

#include "recording/records.hpp"

namespace arbiter::recording {

// Judges schemas, channels and messages in the order of the file. Throws Damage for a channel whose
// schema is missing, a message whose channel is, an identifier that means two things, and where all
// of them together would be more than a reader of the file may have to keep.
class Declarations {
 public:
  explicit Declarations(std::size_t max_bytes) noexcept
      : max_bytes_(std::min(max_bytes, kMaxDeclaredBytes)) {}

  // The memory that a schema or a channel takes, or somewhat more.
  [[nodiscard]] static std::size_t cost_of(std::size_t record_bytes, const McapMap& metadata);

  void judge(const Record& record);

 private:
  // Of the content, instead of it.
  struct Content {
    std::size_t bytes = 0;
    std::uint32_t crc = 0;
    bool operator==(const Content&) const = default;
  };
  using Known = std::map<std::uint16_t, Content>;

  void declare(Known& known, std::uint16_t id, const Record& record, const McapMap& metadata);

  std::size_t max_bytes_;
  std::size_t bytes_ = 0;
  Known schemas_;
  Known channels_;
};

}  // namespace arbiter::recording
