// A fuzzer's input, read as a script: byte by byte, zeros after its end.
#pragma once

#include <cstddef>
#include <cstdint>

namespace arbiter::fuzz {

class Script {
 public:
  Script(const std::uint8_t* data, std::size_t size) noexcept : data_(data), size_(size) {}
  [[nodiscard]] bool is_at_end() const noexcept { return at_ == size_; }
  std::uint8_t byte() noexcept { return at_ < size_ ? data_[at_++] : 0; }
  std::uint64_t word() noexcept {
    std::uint64_t value = 0;
    for (int i = 0; i < 8; ++i) value = value << 8 | byte();
    return value;
  }
  // Mostly a small number.
  std::uint64_t number() noexcept {
    const std::uint8_t value = byte();
    return value == 255 ? word() : value;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t at_ = 0;
};

}  // namespace arbiter::fuzz
