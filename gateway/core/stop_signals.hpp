// SIGTERM, SIGINT and SIGHUP as a descriptor that a loop can wait for.
#pragma once

#include "shm/file_descriptor.hpp"

namespace arbiter::gateway {

// Readable once one of them has come, which no longer ends the process then; SIGPIPE is ignored. So
// is SIGHUP, where whoever started the program has it ignored, as nohup does. Call it before
// threads start, so that no other thread takes them.
[[nodiscard]] shm::FileDescriptor catch_stop_signals();

}  // namespace arbiter::gateway
