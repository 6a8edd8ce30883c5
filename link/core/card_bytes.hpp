// How links write and read what they tell each other: numbers, texts, lists of names.
//
// What is read comes from strangers. Nothing is believed before it was judged: lengths are bounded
// by the caller, and once something is missing or too long, all that follows is 0 or empty.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <arbiter/bytes.hpp>

#include "link/core/little_endian.hpp"

namespace arbiter::link {

using ByteString = std::vector<std::byte>;

inline constexpr std::uint8_t kCardVersion = 1;

class CardWriter {
 public:
  // `incarnation`: of who writes it.
  CardWriter(std::uint32_t magic, std::uint64_t incarnation) {
    number(magic);
    number(kCardVersion);
    number(incarnation);
  }
  template <class Number>
  void number(Number value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof value);
    put(bytes_.data() + at, value);
  }
  void text(std::string_view text) {
    number(static_cast<std::uint16_t>(text.size()));
    for (const char each : text) bytes_.push_back(static_cast<std::byte>(each));
  }
  // With a length that needs four bytes.
  void long_text(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size()));
    const auto* const bytes = reinterpret_cast<const std::byte*>(text.data());
    bytes_.insert(bytes_.end(), bytes, bytes + text.size());
  }
  ByteString take() { return std::move(bytes_); }

 private:
  ByteString bytes_;
};

class CardReader {
 public:
  CardReader(Bytes bytes, std::uint32_t magic) : bytes_(bytes) {
    is_good_ = number<std::uint32_t>() == magic && number<std::uint8_t>() == kCardVersion;
  }
  template <class Number>
  Number number() {
    const std::byte* const from = take(sizeof(Number));
    return from == nullptr ? Number{} : get<Number>(from);
  }
  std::string text(std::size_t most) { return text_of(number<std::uint16_t>(), most); }
  std::string long_text(std::size_t most) { return text_of(number<std::uint32_t>(), most); }
  // What is wrong with something that was read is wrong with all of it.
  void require(bool holds) { is_good_ = is_good_ && holds; }
  [[nodiscard]] bool is_good() const { return is_good_; }

 private:
  std::string text_of(std::size_t length, std::size_t most) {
    if (length > most) is_good_ = false;
    const std::byte* const from = take(length);
    if (from == nullptr) return {};
    return {reinterpret_cast<const char*>(from), length};
  }
  const std::byte* take(std::size_t count) {
    if (!is_good_ || bytes_.size() - at_ < count) {
      is_good_ = false;
      return nullptr;
    }
    const std::byte* const from = bytes_.data() + at_;
    at_ += count;
    return from;
  }

  Bytes bytes_;
  std::size_t at_ = 0;
  bool is_good_ = true;
};

}  // namespace arbiter::link
