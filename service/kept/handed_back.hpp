// Memory that clients hand back to the next daemon.
//
// It is believed only if it is what the predecessor made: a memfd of our own user with the identity
// that the predecessor wrote down in the runtime directory (state_file.hpp), where nobody else may
// write.
#pragma once

#include <cstddef>

#include "shm/file_descriptor.hpp"

namespace arbiter::service {

// Opens for writing what a daemon of this user made and clients may only read. Throws
// std::runtime_error where it is not that.
shm::FileDescriptor reopen_inherited(const shm::FileDescriptor& handed_back, std::size_t size);

}  // namespace arbiter::service
