#include "gateway/dds/freed_memory.hpp"

#include <malloc.h>

namespace arbiter::gateway::dds {

void keep_freed_memory() noexcept {
  constexpr int kLargestBlock = 4 << 20;
  constexpr int kKept = 32 << 20;
  mallopt(M_MMAP_THRESHOLD, kLargestBlock);
  mallopt(M_TRIM_THRESHOLD, kKept);
}

}  // namespace arbiter::gateway::dds
