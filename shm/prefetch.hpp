// Hints that a cache line will be needed. They change nothing but time, whatever the address.
#pragma once

namespace arbiter::shm {

// To be read. The empty statement keeps it: gcc takes a function that only prefetches for one that
// does nothing, and drops the calls of it.
inline void prefetch(const void* address) noexcept {
  __builtin_prefetch(address);
  asm volatile("" : : "r"(address));
}

// To be written: it comes without a copy staying in other cores. Compilers make that of the builtin
// only for processors that are sure to have the instruction, and a prefetch for reading for the
// others; on x86-64 it is a no-operation where it is not known.
inline void prefetch_to_write(const void* address) noexcept {
#if defined(__x86_64__)
  asm volatile("prefetchw %0" : : "m"(*static_cast<const char*>(address)));
#else
  __builtin_prefetch(address, 1);
  asm volatile("" : : "r"(address));
#endif
}

}  // namespace arbiter::shm
