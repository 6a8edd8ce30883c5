// Stands in front of the C library's allocator, in the whole program.
#include "tests/realtime/allocations.hpp"

#include <cerrno>
#include <cstddef>

extern "C" {
// The C library's own, by the names that it keeps for this.
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* memory);
}

namespace arbiter::test {
namespace {

thread_local std::uint64_t calls = 0;

}  // namespace

std::uint64_t allocations_of_this_thread() { return calls; }

}  // namespace arbiter::test

// AddressSanitizer stands there itself: in its builds nothing is counted.
#if !defined(__SANITIZE_ADDRESS__)
using arbiter::test::calls;

extern "C" {

void* malloc(std::size_t size) {
  ++calls;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++calls;
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  ++calls;
  return __libc_realloc(memory, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  ++calls;
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  *memory = memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}
void free(void* memory) {
  if (memory != nullptr) ++calls;
  __libc_free(memory);
}

}  // extern "C"
#endif
