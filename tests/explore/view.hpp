// What a thread, a store or a fence knows: of each word the oldest store that may still be seen.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>

namespace arbiter::explore {

// By index of the word; what is beyond the end is 0. The first are the threads' own clocks, by
// which plain data is ordered.
class View {
 public:
  static constexpr std::size_t kThreads = 4;
  static constexpr std::size_t kMaxWords = 1024;

  View() noexcept = default;
  View(const View& other) noexcept { *this = other; }
  View& operator=(const View& other) noexcept {
    size_ = other.size_;
    std::copy_n(other.time_, size_, time_);
    return *this;
  }
  void clear() noexcept { size_ = 0; }

  [[nodiscard]] std::uint32_t at(std::size_t index) const noexcept {
    return index < size_ ? time_[index] : 0;
  }
  void set(std::size_t index, std::uint32_t time) {
    if (index >= kMaxWords || time > UINT16_MAX) throw std::logic_error("a scenario too large");
    if (index >= size_) resize(index + 1);
    time_[index] = static_cast<std::uint16_t>(time);
  }
  void join(const View& other) noexcept {
    if (size_ < other.size_) resize(other.size_);
    for (std::size_t i = 0; i < other.size_; ++i) time_[i] = std::max(time_[i], other.time_[i]);
  }

 private:
  void resize(std::size_t size) noexcept {
    std::fill(time_ + size_, time_ + size, std::uint16_t{0});
    size_ = size;
  }

  std::size_t size_ = 0;
  std::uint16_t time_[kMaxWords];
};

}  // namespace arbiter::explore
