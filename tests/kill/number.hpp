// What the victim and the survivors send each other.
#pragma once

#include <cstdint>

namespace arbiter::test {

struct Number {
  std::uint64_t value;
  std::uint64_t inverse;

  [[nodiscard]] bool is_whole() const { return value == ~inverse; }
};
inline Number make_number(std::uint64_t value) { return {value, ~value}; }

}  // namespace arbiter::test
