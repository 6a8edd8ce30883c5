// What stands for the kernel where the real sources are explored: segments that lie at one address
// for all who map them, bells that the explorer sees, and a clock that goes by one at each reading.
#pragma once

#include <sys/types.h>

#include <cstddef>

#include "shm/activity.hpp"
#include "shm/bell.hpp"

namespace arbiter::explore {

shm::Nanoseconds virtual_time();
void set_virtual_time(shm::Nanoseconds time);
bool is_rung(const shm::Bell& bell);
// When the timer of the newest descriptor to wait on expires; kForever: never.
shm::Nanoseconds timer_expires_at();

void* real_mmap(void* at, std::size_t size, int protection, int flags, int fd, off_t offset);
int real_munmap(void* at, std::size_t size);
// The C library's: what gcc writes in its place for a page is several times slower.
void real_memcpy(void* to, const void* from, std::size_t size);

}  // namespace arbiter::explore
