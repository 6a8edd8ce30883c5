// Where a test gets between the library and memory: at each atomic load, and before each atomic
// operation.
#pragma once

#include <cstddef>
#include <cstdint>

namespace arbiter::fuzz {

class Seam {
 public:
  Seam() = default;
  Seam(const Seam&) = delete;
  Seam& operator=(const Seam&) = delete;
  virtual ~Seam() = default;

  // What a load of `size` bytes yields in the place of `value`.
  virtual std::uint64_t load(const void* address, std::uint64_t value, std::size_t size) = 0;
  virtual void before_operation() {}

  // None, unless a test sets one. The tests have one thread.
  static inline Seam* current = nullptr;
};

}  // namespace arbiter::fuzz
