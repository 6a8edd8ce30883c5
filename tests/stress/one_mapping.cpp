// For ThreadSanitizer: all ports of one process see a segment at one address.
//
// In a program of several nodes each maps each segment for itself, and ThreadSanitizer, which goes
// by addresses, would see neither the synchronisation nor the races between them. The linker leads
// the calls of mmap() and munmap() in our objects here (--wrap). A segment that is mapped already
// is given again; a mapping that may be written replaces, in place, one that may only be read.
#include <sys/mman.h>
#include <sys/stat.h>

#include <cstddef>
#include <map>
#include <mutex>
#include <utility>

extern "C" {
void* __real_mmap(void* address, std::size_t size, int protection, int flags, int fd, off_t at);
int __real_munmap(void* address, std::size_t size);
void* __wrap_mmap(void* address, std::size_t size, int protection, int flags, int fd, off_t at);
int __wrap_munmap(void* address, std::size_t size);
}

namespace {

struct OneMapping {
  void* address = nullptr;
  int protection = 0;
  std::size_t users = 0;
};

std::mutex mutex;

std::map<ino_t, OneMapping>& mappings() {
  static auto* const all = new std::map<ino_t, OneMapping>;  // outlives whoever unmaps last
  return *all;
}

}  // namespace

void* __wrap_mmap(void* address, std::size_t size, int protection, int flags, int fd, off_t at) {
  struct stat status {};
  const bool shared = (flags & MAP_SHARED) != 0 && fd >= 0 && address == nullptr && at == 0;
  if (!shared || fstat(fd, &status) != 0) {
    return __real_mmap(address, size, protection, flags, fd, at);
  }
  const std::lock_guard lock(mutex);
  OneMapping& one = mappings()[status.st_ino];
  if (one.users == 0 || (protection & ~one.protection) != 0) {
    const int fixed = one.users == 0 ? 0 : MAP_FIXED;
    void* const mapped = __real_mmap(one.address, size, protection, flags | fixed, fd, at);
    if (mapped == MAP_FAILED) {
      if (one.users == 0) mappings().erase(status.st_ino);
      return mapped;
    }
    one.address = mapped;
    one.protection = protection;
  }
  ++one.users;
  return one.address;
}

int __wrap_munmap(void* address, std::size_t size) {
  const std::lock_guard lock(mutex);
  for (auto each = mappings().begin(); each != mappings().end(); ++each) {
    if (each->second.address != address) continue;
    if (--each->second.users != 0) return 0;
    mappings().erase(each);
    break;
  }
  return __real_munmap(address, size);
}
