// Memory that is there before it is used: a data path that touches a page for the first time would
// wait for the kernel to map it (a page fault), and one that was paged out, for the disk.
//
// Maps are made off the data path, and made resident there too: mapped page by page, and locked
// into memory where the component asks for it (NodeOptions::lock_memory).
#pragma once

#include <cstddef>

#include "shm/file_descriptor.hpp"
#include "shm/segment.hpp"

namespace arbiter::shm {

enum class Residence {
  kMapped,  // pages are mapped now; under pressure the kernel may take them away
  kLocked,  // and stay (mlock)
};

// Makes a byte range of a mapping resident. It must be allocated: what was not would be now. Throws
// std::system_error where it cannot be locked, saying which limit is in the way. Without a lock
// nothing fails: a page that could not be mapped now faults when it is used.
void make_resident(const Mapping& mapping, std::size_t offset, std::size_t bytes,
                   Residence residence);

// The same for all that has been written of a segment which reserves more than it uses, and whose
// use only its writer knows.
void make_written_resident(const FileDescriptor& segment, const Mapping& mapping,
                           Residence residence);

}  // namespace arbiter::shm
