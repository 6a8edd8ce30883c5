// SIGTERM, SIGINT and SIGHUP as a descriptor that a loop can wait for, and SIGUSR1 as another.
#pragma once

#include "shm/file_descriptor.hpp"

namespace arbiter::gateway {

// Readable once one of them has come, which no longer ends the process then. SIGPIPE and SIGXFSZ
// are ignored: a log that cannot be written, or memory that is limited, ends nobody. So is SIGHUP,
// where whoever started the program has it ignored, as nohup does. Call it before threads start, so
// that no other thread takes them.
[[nodiscard]] shm::FileDescriptor catch_stop_signals();

// The same of SIGUSR1, which asks for the mapping to be read again.
[[nodiscard]] shm::FileDescriptor catch_reload_signal();

}  // namespace arbiter::gateway
