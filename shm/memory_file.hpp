// A file in memory, without a name: it goes with its last descriptor, and others read it below
// /proc/self/fd.
#pragma once

#include <sys/mman.h>

#include <string_view>

#include "shm/file_descriptor.hpp"

namespace arbiter::shm {

// `name`: what /proc shows. `flags`: of memfd_create. Throws std::system_error.
[[nodiscard]] FileDescriptor memory_file(const char* name, std::string_view content,
                                         unsigned flags = MFD_CLOEXEC);

// Whether all of it has been written there, whatever the file; if not, errno says why.
[[nodiscard]] bool write_whole(int file, std::string_view content) noexcept;

}  // namespace arbiter::shm
