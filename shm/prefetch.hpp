// Hints to bring a cache line here before it is needed. They read and write nothing, and any
// address will do.
#pragma once

namespace arbiter::shm {

inline void prefetch_to_read(const void* line) noexcept { __builtin_prefetch(line); }

// For a line that we are about to write: the other cores give it up at once, not only when the
// write comes. GCC knows of the instruction only if told that every processor has it; those that do
// not take it for one that does nothing.
inline void prefetch_to_write(void* line) noexcept {
#if defined(__x86_64__)
  asm("prefetchw %0" : : "m"(*static_cast<const char*>(line)));
#else
  __builtin_prefetch(line, 1);
#endif
}

}  // namespace arbiter::shm
