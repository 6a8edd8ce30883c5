// How much of what is freed the process keeps, in place of giving it back to the kernel.
#pragma once

namespace arbiter::gateway::dds {

// Cyclone receives into buffers of 1 MiB that it allocates and frees. As glibc comes, it gives the
// kernel back what is freed of a few of them, and the next large sample is received into new pages,
// of which each costs a fault. From here on blocks of up to 4 MiB come from the heap, which keeps
// up to 32 MiB that are free at its end: each heap, for glibc has several (arenas). One for all
// threads would keep less, but there a thread that receives would wait for a lock that the node's
// thread of low priority may hold. Called at the start of a program.
void keep_freed_memory() noexcept;

}  // namespace arbiter::gateway::dds
