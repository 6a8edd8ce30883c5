// SIGTERM and SIGINT as a descriptor that a loop can wait for.
#pragma once

#include "shm/file_descriptor.hpp"

namespace arbiter::gateway {

// Readable once one of the two has come, which no longer ends the process then; SIGPIPE is ignored.
// Call it before threads start, so that no other thread takes them.
[[nodiscard]] shm::FileDescriptor catch_stop_signals();

}  // namespace arbiter::gateway
