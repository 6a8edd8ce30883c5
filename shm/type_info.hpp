// What a port carries, as its segment declares it and as both ends check it.
#pragma once

#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include "shm/limits.hpp"

namespace arbiter::shm {

inline constexpr std::uint32_t kMaxTypeName = 239;
inline constexpr std::uint64_t kMaxTypeSize = std::uint64_t{1} << 40;
inline constexpr std::uint64_t kMaxAlignment = kPageSize;

// Plain data: lies in segments and travels in messages.
struct TypeInfo {
  char name[kMaxTypeName + 1] = {};  // terminated; empty where the port is untyped
  std::uint64_t size = 0;       // bytes of a sample; untyped or variable: the most there can be
  std::uint64_t alignment = 1;  // 0: the type is variable

  [[nodiscard]] bool is_typed() const noexcept { return name[0] != '\0'; }
  // It has a name, and samples of any size.
  [[nodiscard]] bool is_variable() const noexcept { return is_typed() && alignment == 0; }
  // Bytes of each sample; 0: they may have any size.
  [[nodiscard]] std::uint64_t one_size() const noexcept {
    return is_typed() && alignment != 0 ? size : 0;
  }
  [[nodiscard]] std::string_view type_name() const noexcept {
    return {name, strnlen(name, kMaxTypeName)};
  }
  void set_name(std::string_view text) noexcept {
    const std::size_t length = text.size() < kMaxTypeName ? text.size() : kMaxTypeName;
    if (length != 0) std::memcpy(name, text.data(), length);  // an empty view may point nowhere
    name[length] = '\0';
  }

  // The rule: two types are equal if their names are, byte for byte, and their sizes, and their
  // alignments; of variable ones the names alone. Nothing else is known of them.
  friend bool operator==(const TypeInfo& one, const TypeInfo& other) noexcept {
    return one.type_name() == other.type_name() && one.alignment == other.alignment &&
           (one.size == other.size || one.is_variable());
  }
};

// What is wrong with a type as somebody declares it, as a sentence's end; empty: nothing. Blanks
// are fine in its name, for C++ writes them ("unsigned int").
[[nodiscard]] std::optional<std::string> fault_of(const TypeInfo& type);

// "geometry/Twist (48 bytes, aligned to 8)". The name is made printable.
[[nodiscard]] std::string describe(const TypeInfo& type);

// Empty if samples of `output` may go to `input`; else what is wrong, as a sentence's end, which
// names both. `sender` and `receiver`: the components' nodes, where they are known. It fits into a
// message: type names are told in full, nodes' names are cut.
[[nodiscard]] std::string type_mismatch(const TypeInfo& output, const TypeInfo& input,
                                        std::string_view sender = {},
                                        std::string_view receiver = {});

}  // namespace arbiter::shm
