// What a port carries, as its segment declares it and as both ends check it.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "shm/utf8.hpp"

namespace arbiter::shm {

inline constexpr std::uint32_t kMaxTypeName = 239;

// Plain data: lies in segments and travels in messages.
struct TypeInfo {
  char name[kMaxTypeName + 1] = {};  // terminated; empty where the port is untyped
  std::uint64_t size = 0;            // bytes of a sample; untyped: the most there can be
  std::uint64_t alignment = 1;

  [[nodiscard]] bool is_typed() const noexcept { return name[0] != '\0'; }
  [[nodiscard]] std::string_view type_name() const noexcept {
    return {name, strnlen(name, kMaxTypeName)};
  }
  void set_name(std::string_view text) noexcept {
    const std::size_t length = text.size() < kMaxTypeName ? text.size() : kMaxTypeName;
    if (length != 0) std::memcpy(name, text.data(), length);  // an empty view may point nowhere
    name[length] = '\0';
  }
};

// Empty if samples of `output` may go to `input`; else what is wrong, as a sentence's end. Types
// are what components say they are: their names are made printable.
inline std::string type_mismatch(const TypeInfo& output, const TypeInfo& input) {
  if (!input.is_typed()) return {};
  const std::string wanted = printable(input.type_name());
  if (!output.is_typed()) return "the output port is untyped, the input port takes " + wanted;
  if (output.type_name() != input.type_name()) {
    return "the output port sends " + printable(output.type_name()) + ", the input port takes " +
           wanted;
  }
  if (output.size != input.size) {
    return wanted + " has " + std::to_string(output.size) + " bytes at the output port and " +
           std::to_string(input.size) + " at the input port";
  }
  if (output.alignment != input.alignment) {
    return wanted + " is aligned to " + std::to_string(output.alignment) +
           " bytes at the output port and to " + std::to_string(input.alignment) +
           " at the input port";
  }
  return {};
}

}  // namespace arbiter::shm
