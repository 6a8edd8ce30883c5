// How a conversation ends, and what happens to descriptors that nobody has taken: closing them may
// take any time, so it is an errand of the user who sent them.
#pragma once

#include <sys/types.h>

#include "shm/file_descriptor.hpp"
#include "wire/messages.hpp"

namespace arbiter::wire {

// Closes a client's socket: at once, or, where unread messages in it bring descriptors, which may
// take any time to close, as an errand of that user.
void hang_up(shm::FileDescriptor socket, uid_t user);

// Closes what a message has brought and nobody has taken, as errands of the user who sent it.
void dispose_of(Received& received, uid_t user);

}  // namespace arbiter::wire
