// Pages are made read-only when the image is taken. The first write to one faults: then its
// contents are saved, and from then on it is copied back each time.
#include "tests/explore/image.hpp"

#include <signal.h>
#include <sys/mman.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>
#include <stdexcept>

#include "shm/clock.hpp"
#include "shm/limits.hpp"
#include "tests/explore/kernel.hpp"

namespace arbiter::explore {
namespace {

constexpr std::size_t kPage = shm::kPageSize;
constexpr std::size_t kHeapSize = std::size_t{16} << 20;
constexpr std::size_t kSize = std::size_t{1} << 30;
constexpr std::size_t kMaxDirty = 1024;

struct Memory {
  std::byte* base = nullptr;
  std::size_t heap_used = 0;
  std::size_t pages_used = kHeapSize;  // beyond the heap
  std::size_t heap_taken = 0;
  shm::Nanoseconds time_taken = 0;
  std::size_t dirty_count = 0;
  std::size_t dirty[kMaxDirty];  // offsets of pages
  std::byte* saved = nullptr;    // their contents
} memory;

void save_page(int signal, siginfo_t* info, void*) {
  auto* const at = static_cast<std::byte*>(info->si_addr);
  if (!Image::owns(at) || memory.dirty_count == kMaxDirty) {
    ::signal(signal, SIG_DFL);
    return;
  }
  const std::size_t offset = static_cast<std::size_t>(at - memory.base) / kPage * kPage;
  std::memcpy(memory.saved + memory.dirty_count * kPage, memory.base + offset, kPage);
  memory.dirty[memory.dirty_count++] = offset;
  mprotect(memory.base + offset, kPage, PROT_READ | PROT_WRITE);
}

std::size_t round_up(std::size_t value, std::size_t to) { return (value + to - 1) / to * to; }

}  // namespace

Image::Image() {
  if (exists_) throw std::logic_error("one image at a time");
  constexpr int kFlags = MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE;
  void* const base = real_mmap(nullptr, kSize, PROT_READ | PROT_WRITE, kFlags, -1, 0);
  void* const saved = real_mmap(nullptr, kMaxDirty * kPage, PROT_READ | PROT_WRITE, kFlags, -1, 0);
  if (base == MAP_FAILED || saved == MAP_FAILED) throw std::bad_alloc();
  memory = {};
  memory.base = static_cast<std::byte*>(base);
  memory.saved = static_cast<std::byte*>(saved);
  struct sigaction action {};
  action.sa_sigaction = save_page;
  action.sa_flags = SA_SIGINFO | SA_NODEFER;
  sigaction(SIGSEGV, &action, nullptr);
  exists_ = true;
}

Image::~Image() {
  exists_ = inside_ = false;
  signal(SIGSEGV, SIG_DFL);
  real_munmap(memory.base, kSize);
  real_munmap(memory.saved, kMaxDirty * kPage);
  memory = {};
}

void Image::take() {
  memory.heap_taken = memory.heap_used = round_up(memory.heap_used, kPage);
  memory.time_taken = virtual_time();
  mprotect(memory.base, memory.heap_taken, PROT_READ);
  mprotect(memory.base + kHeapSize, memory.pages_used - kHeapSize, PROT_READ);
}

void Image::restore() {
  for (std::size_t i = 0; i < memory.dirty_count; ++i) {
    real_memcpy(memory.base + memory.dirty[i], memory.saved + i * kPage, kPage);
  }
  memory.heap_used = memory.heap_taken;
  set_virtual_time(memory.time_taken);
}

std::byte* Image::allocate_pages(std::size_t size) {
  const std::size_t at = memory.pages_used;
  if (!exists_ || at + size > kSize) throw std::bad_alloc();
  memory.pages_used += round_up(size, kPage);
  return memory.base + at;
}

void* Image::allocate(std::size_t size, std::size_t alignment) {
  const std::size_t at = round_up(memory.heap_used, alignment);
  if (at + size > kHeapSize) throw std::bad_alloc();
  memory.heap_used = at + size;
  return memory.base + at;
}

bool Image::owns(const void* address) noexcept {
  const auto* const at = static_cast<const std::byte*>(address);
  return memory.base != nullptr && at >= memory.base && at < memory.base + kSize;
}

bool Image::is_segment(const void* address) noexcept {
  return owns(address) && static_cast<const std::byte*>(address) >= memory.base + kHeapSize;
}

}  // namespace arbiter::explore

using arbiter::explore::Image;

void* operator new(std::size_t size, std::align_val_t alignment) {
  if (Image::is_inside()) return Image::allocate(size, static_cast<std::size_t>(alignment));
  const auto unit = static_cast<std::size_t>(alignment);
  void* const at = std::aligned_alloc(unit, (size + unit - 1) / unit * unit);
  if (at == nullptr) throw std::bad_alloc();
  return at;
}
void* operator new(std::size_t size) {
  if (Image::is_inside()) return Image::allocate(size, alignof(std::max_align_t));
  void* const at = std::malloc(size == 0 ? 1 : size);
  if (at == nullptr) throw std::bad_alloc();
  return at;
}
void operator delete(void* address) noexcept {
  if (!Image::owns(address)) std::free(address);
}
void operator delete(void* address, std::size_t) noexcept { operator delete(address); }
void operator delete(void* address, std::align_val_t) noexcept { operator delete(address); }
void operator delete(void* address, std::size_t, std::align_val_t) noexcept {
  operator delete(address);
}
