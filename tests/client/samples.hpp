// What the tests' ports carry.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

namespace arbiter::test {

struct Number {
  std::int64_t value = 0;
};

// The value that is taken, or that of no sample if there is none.
inline constexpr std::int64_t kNothing = INT64_MIN;
inline std::int64_t take_from(InputPort<Number>& in) {
  const auto sample = in.take();
  return sample ? (*sample)->value : kNothing;
}

// All that waits.
inline std::vector<std::int64_t> take_all(InputPort<Number>& in) {
  std::vector<std::int64_t> values;
  while (auto sample = in.take()) values.push_back((**sample).value);
  return values;
}

// 4 MiB.
struct Image {
  std::array<unsigned char, std::size_t{4} << 20> bytes;
};

// The file that is mapped at an address, "device:inode offset"; the same in every process that maps
// the same memory.
inline std::string where(const void* pointer) {
  const auto address = reinterpret_cast<std::uintptr_t>(pointer);
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    std::istringstream fields(line);
    std::uintptr_t begin = 0;
    std::uintptr_t end = 0;
    std::uintptr_t offset = 0;
    char dash = 0;
    std::string access;
    std::string device;
    std::string inode;
    fields >> std::hex >> begin >> dash >> end >> access >> offset >> device >> inode;
    if (address < begin || address >= end) continue;
    return device + "/" + inode + "+" + std::to_string(address - begin + offset);
  }
  return "nowhere";
}

}  // namespace arbiter::test
