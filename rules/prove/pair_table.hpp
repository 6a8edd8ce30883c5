// Where a pair of nodes lies in a table of pairs: its own place, or the next one that is free or
// has it.
//
// Thread safety: a function without a state.
#pragma once

#include <cstddef>
#include <cstdint>

namespace arbiter::rules {

// What a place that is free has in place of a pair.
inline constexpr std::uint64_t kNoPair = ~std::uint64_t{0};

// `places`: a power of two, and more than there are pairs. `at(place)`: the pair there, or kNoPair.
template <class At>
[[nodiscard]] std::size_t place_of_pair(std::uint64_t pair, std::size_t places, const At& at) {
  const std::size_t mask = places - 1;
  std::size_t place = (pair * 0x9E3779B97F4A7C15u) >> 32 & mask;
  for (std::uint64_t there = at(place); there != kNoPair && there != pair; there = at(place)) {
    place = (place + 1) & mask;
  }
  return place;
}

}  // namespace arbiter::rules
