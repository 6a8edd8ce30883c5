#include "shm/residence.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <system_error>

#include "shm/limits.hpp"
#include "shm/lock_limit.hpp"

namespace arbiter::shm {
namespace {

// How many separate ranges of a foreign segment are heeded: one that has more is made to keep us
// busy.
constexpr int kMaxRanges = 4096;

[[noreturn]] void fail_to_lock(std::size_t bytes, int error) {
  std::string what = "locking " + kibibytes(bytes) + " more of shared memory";
  const std::string limit = lock_limit_text();
  if (!limit.empty() && (error == ENOMEM || error == EPERM || error == EAGAIN)) {
    what += ": " + limit;
  }
  throw std::system_error(error, std::generic_category(), what);
}

}  // namespace

void make_resident(const Mapping& mapping, std::size_t offset, std::size_t bytes,
                   Residence residence) {
  const std::size_t begin = offset / kPageSize * kPageSize;
  const std::size_t end = std::min(offset + bytes, mapping.size());
  if (begin >= end) return;
  std::byte* const at = mapping.data() + begin;
  // Fails on a kernel before 5.14, or for a mapping that is only read, where the other one does.
  if (madvise(at, end - begin, MADV_POPULATE_WRITE) != 0) {
    static_cast<void>(madvise(at, end - begin, MADV_POPULATE_READ));
  }
  if (residence == Residence::kLocked && mlock(at, end - begin) != 0) {
    fail_to_lock(end - begin, errno);
  }
}

// The kernel knows what has been written: the rest are holes. Reading those would allocate them.
// (The offset of the descriptor, which all who have it share, is used by nobody.)
void make_written_resident(const FileDescriptor& segment, const Mapping& mapping,
                           Residence residence) {
  const auto size = static_cast<off_t>(mapping.size());
  off_t end = 0;
  for (int ranges = 0; ranges < kMaxRanges && end < size; ++ranges) {
    const off_t begin = lseek(segment.get(), end, SEEK_DATA);
    if (begin < 0 || begin >= size) return;
    end = lseek(segment.get(), begin, SEEK_HOLE);
    if (end <= begin) return;
    make_resident(mapping, static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin),
                  residence);
  }
}

}  // namespace arbiter::shm
