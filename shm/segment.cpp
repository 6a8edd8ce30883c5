#include "shm/segment.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <stdexcept>
#include <string>

#include <boost/interprocess/exceptions.hpp>

#include "shm/foreign.hpp"
#include "shm/limits.hpp"
#include "shm/lock_limit.hpp"

namespace arbiter::shm {
namespace {

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

// What Boost.Interprocess maps: anything that tells a mapping handle.
class MemoryMappable {
 public:
  explicit MemoryMappable(int fd) noexcept : handle_{fd, false} {}
  [[nodiscard]] boost::interprocess::mapping_handle_t get_mapping_handle() const { return handle_; }

 private:
  boost::interprocess::mapping_handle_t handle_;
};

constexpr int seal_bits(Seals seals) {
  const int fixed = F_SEAL_SHRINK | F_SEAL_GROW;
  return seals == Seals::kOneWriter ? fixed | F_SEAL_FUTURE_WRITE : fixed;
}

// EAGAIN: of a process that has called mlockall(), which then locks what it maps.
[[noreturn]] void fail_to_map(std::size_t bytes, int error) {
  std::string what = "mapping " + kibibytes(bytes) + " of shared memory";
  const std::string limit = lock_limit_text();
  if (error == EAGAIN && !limit.empty()) {
    what += ", all of which would be locked (mlockall with MCL_FUTURE): " + limit +
            ", or leave MCL_FUTURE out";
  }
  throw std::system_error(error, std::generic_category(), what);
}

// The process would be ended by SIGXFSZ.
void require_file_size(std::size_t bytes) {
  rlimit limit{};
  if (getrlimit(RLIMIT_FSIZE, &limit) != 0 || bytes <= limit.rlim_cur) return;
  throw std::system_error(EFBIG, std::generic_category(),
                          "a segment of " + kibibytes(bytes) +
                              ", which is a file: this process may write files of " +
                              kibibytes(limit.rlim_cur) + " (RLIMIT_FSIZE, ulimit -f)");
}

}  // namespace

FileDescriptor make_segment(const char* name, std::size_t size) {
  require_file_size(size);
  FileDescriptor segment(memfd_create(name, MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!segment) fail("memfd_create");
  if (fchmod(segment.get(), 0644) != 0) fail("fchmod of a segment");
  if (ftruncate(segment.get(), static_cast<off_t>(size)) != 0) fail("ftruncate of a segment");
  return segment;
}

void seal(const FileDescriptor& segment, Seals seals) {
  if (fcntl(segment.get(), F_ADD_SEALS, seal_bits(seals) | F_SEAL_SEAL) != 0) {
    fail("sealing a segment");
  }
}

// Before Linux 6.8 a signal ends a call without a trace of what it has done: under a timer that is
// faster than the whole, only parts come to an end.
std::error_code allocate(const FileDescriptor& segment, std::size_t offset,
                         std::size_t bytes) noexcept {
  std::size_t most = bytes;
  while (bytes != 0) {
    const std::size_t step = std::min(bytes, most);
    if (fallocate(segment.get(), 0, static_cast<off_t>(offset), static_cast<off_t>(step)) == 0) {
      offset += step;
      bytes -= step;
    } else if (errno == EINTR) {
      most = std::max(step / 2, kPageSize);
    } else {
      return {errno, std::generic_category()};
    }
  }
  return {};
}

FileDescriptor reopen(const FileDescriptor& segment, int flags) {
  const std::string path = "/proc/self/fd/" + std::to_string(segment.get());
  FileDescriptor opened(::open(path.c_str(), flags | O_CLOEXEC | O_NONBLOCK));
  if (!opened && errno == EWOULDBLOCK) {
    throw std::runtime_error("its maker holds a lease on the memory, which keeps others waiting");
  }
  if (!opened) fail("reopening a descriptor");
  return opened;
}

std::size_t checked_size(const FileDescriptor& segment, Seals wanted) {
  if (!segment) throw std::runtime_error("the descriptor of a segment is missing");
  if (foreign_kind(segment.get()) != ForeignKind::kMemfd) {
    throw std::runtime_error("the descriptor is not a memfd");
  }
  const int seals = fcntl(segment.get(), F_GET_SEALS);
  if ((seals & seal_bits(wanted)) != seal_bits(wanted)) {
    throw std::runtime_error("the segment is not sealed as it must be");
  }
  struct stat status {};
  if (fstat(segment.get(), &status) != 0) fail("fstat of a segment");
  return static_cast<std::size_t>(status.st_size);
}

SegmentIdentity identity_of(const FileDescriptor& segment) {
  struct stat file {};
  if (fstat(segment.get(), &file) != 0) {
    throw std::system_error(errno, std::generic_category(), "looking at a segment");
  }
  return {file.st_dev, file.st_ino};
}

bool are_one_segment(const FileDescriptor& one, const FileDescriptor& other) noexcept {
  struct stat a {};
  struct stat b {};
  return fstat(one.get(), &a) == 0 && fstat(other.get(), &b) == 0 && a.st_ino == b.st_ino &&
         a.st_dev == b.st_dev;
}

std::size_t allocated_size(const FileDescriptor& segment) noexcept {
  struct stat status {};
  if (fstat(segment.get(), &status) != 0) return 0;
  constexpr std::size_t kBlock = 512;
  return static_cast<std::size_t>(status.st_blocks) * kBlock;
}

std::size_t end_of_data(const FileDescriptor& segment, std::size_t offset) noexcept {
  const off_t end = lseek(segment.get(), static_cast<off_t>(offset), SEEK_HOLE);
  return end < 0 ? offset : static_cast<std::size_t>(end);
}

bool copy_out(const FileDescriptor& segment, std::size_t offset, void* to,
              std::size_t bytes) noexcept {
  auto* at = static_cast<char*>(to);
  while (bytes != 0) {
    const ssize_t count = pread(segment.get(), at, bytes, static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    at += count;
    offset += static_cast<std::size_t>(count);
    bytes -= static_cast<std::size_t>(count);
  }
  return true;
}

Mapping::Mapping(const FileDescriptor& segment, std::size_t size, Access access) {
  namespace bip = boost::interprocess;
  try {
    bip::mapped_region region(MemoryMappable(segment.get()),
                              access == Access::kReadOnly ? bip::read_only : bip::read_write, 0,
                              size);
    region_.swap(region);
  } catch (const bip::interprocess_exception& error) {
    fail_to_map(size, error.get_native_error());
  }
  if (access == Access::kReadWrite) madvise(data(), this->size(), MADV_DONTFORK);
}

// It is mapped elsewhere first, where it may fail, and then moved: the kernel puts it into the
// place of the old one in one step.
void Mapping::replace(const FileDescriptor& segment) {
  void* const next = ::mmap(nullptr, size(), PROT_READ, MAP_SHARED, segment.get(), 0);
  if (next == MAP_FAILED) fail_to_map(size(), errno);
  if (::mremap(next, size(), size(), MREMAP_MAYMOVE | MREMAP_FIXED, data()) == MAP_FAILED) {
    const int error = errno;
    ::munmap(next, size());
    errno = error;
    fail("mapping a segment in the place of another");
  }
}

}  // namespace arbiter::shm
