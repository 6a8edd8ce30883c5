// The linker leads the calls of mmap() and munmap() in our objects here (--wrap).
#include "tests/fuzz/segments/guarded_mapping.hpp"

#include <sys/mman.h>
#include <sys/stat.h>

#include <cstdint>
#include <map>
#include <set>

extern "C" {
void* __real_mmap(void* address, std::size_t size, int protection, int flags, int fd, off_t at);
int __real_munmap(void* address, std::size_t size);
void* __wrap_mmap(void* address, std::size_t size, int protection, int flags, int fd, off_t at);
int __wrap_munmap(void* address, std::size_t size);
}

namespace arbiter::fuzz {
namespace {

constexpr std::size_t kPage = 4096;

struct Guarded {
  std::size_t size = 0;
  bool hostile = false;
};

std::map<std::uintptr_t, Guarded>& mappings() {
  static auto* const all = new std::map<std::uintptr_t, Guarded>;
  return *all;
}
std::set<ino_t>& hostile_files() {
  static auto* const all = new std::set<ino_t>;
  return *all;
}

ino_t inode_of(int fd) {
  struct stat status {};
  return fstat(fd, &status) == 0 ? status.st_ino : 0;
}

std::size_t round_up(std::size_t size) { return (size + kPage - 1) / kPage * kPage; }

const Guarded* find(const void* address, std::size_t size) noexcept {
  const auto at = reinterpret_cast<std::uintptr_t>(address);
  auto next = mappings().upper_bound(at);
  if (next == mappings().begin()) return nullptr;
  --next;
  return at + size <= next->first + next->second.size ? &next->second : nullptr;
}

}  // namespace

void declare_hostile(int fd) { hostile_files().insert(inode_of(fd)); }

bool is_hostile(const void* address) noexcept {
  const Guarded* mapping = find(address, 1);
  return mapping != nullptr && mapping->hostile;
}

bool is_mapped(const void* address, std::size_t size) noexcept {
  return find(address, size) != nullptr;
}

}  // namespace arbiter::fuzz

using arbiter::fuzz::kPage;

void* __wrap_mmap(void* address, std::size_t size, int protection, int flags, int fd, off_t at) {
  if ((flags & MAP_SHARED) == 0 || fd < 0 || address != nullptr) {
    return __real_mmap(address, size, protection, flags, fd, at);
  }
  const std::size_t whole = arbiter::fuzz::round_up(size);
  void* const reserved = __real_mmap(nullptr, whole + 2 * kPage, PROT_NONE,
                                     MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (reserved == MAP_FAILED) return reserved;
  void* const inside = static_cast<std::byte*>(reserved) + kPage;
  void* const mapped = __real_mmap(inside, size, protection, flags | MAP_FIXED, fd, at);
  if (mapped == MAP_FAILED) {
    __real_munmap(reserved, whole + 2 * kPage);
    return mapped;
  }
  const bool hostile = (protection & PROT_WRITE) == 0 &&
                       arbiter::fuzz::hostile_files().count(arbiter::fuzz::inode_of(fd)) != 0;
  arbiter::fuzz::mappings()[reinterpret_cast<std::uintptr_t>(mapped)] = {size, hostile};
  return mapped;
}

int __wrap_munmap(void* address, std::size_t size) {
  if (arbiter::fuzz::mappings().erase(reinterpret_cast<std::uintptr_t>(address)) == 0) {
    return __real_munmap(address, size);
  }
  return __real_munmap(static_cast<std::byte*>(address) - kPage,
                       arbiter::fuzz::round_up(size) + 2 * kPage);
}
