// In the place of shm/segment.cpp, shm/bell.cpp, and some calls of the C library
// (-Wl,--wrap, see CMakeLists.txt).
#include "tests/explore/kernel.hpp"

#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/timerfd.h>
#include <time.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <stdexcept>

#include "shm/bell.hpp"
#include "shm/descendants.hpp"
#include "shm/residence.hpp"
#include "shm/segment.hpp"
#include "tests/explore/explorer.hpp"
#include "tests/explore/image.hpp"

extern "C" {
void* __real_mmap(void* at, std::size_t size, int protection, int flags, int fd, off_t offset);
int __real_munmap(void* at, std::size_t size);
int __real_timerfd_create(int clock, int flags);
void* __real_memcpy(void* to, const void* from, std::size_t size);
}

namespace arbiter {
namespace explore {
namespace {

// Descriptors of segments, and of bells opened anew; the real kernel has none of these.
constexpr int kFirstSegment = 100'000'000;
constexpr int kFirstRinger = 200'000'000;

struct Segment {
  std::byte* base;
  std::size_t size;
};
std::map<int, Segment> segments;
int next_segment = kFirstSegment;

// By descriptor: whether the bell has been rung. The words lie in the image.
std::map<int, shm::Atomic<std::uint32_t>*> bells;

// When the timer that was made last expires. The word lies in the image.
shm::Atomic<shm::Nanoseconds>* timer = nullptr;

shm::Atomic<shm::Nanoseconds> now{1000};

}  // namespace

shm::Nanoseconds virtual_time() { return now.load(std::memory_order_relaxed); }
void set_virtual_time(shm::Nanoseconds time) { now.store(time, std::memory_order_relaxed); }
bool is_rung(const shm::Bell& bell) {
  return bells.at(bell.read_end())->load(std::memory_order_relaxed) != 0;
}
shm::Nanoseconds timer_expires_at() { return timer->load(std::memory_order_relaxed); }

void* real_mmap(void* at, std::size_t size, int protection, int flags, int fd, off_t offset) {
  return __real_mmap(at, size, protection, flags, fd, offset);
}
int real_munmap(void* at, std::size_t size) { return __real_munmap(at, size); }
void real_memcpy(void* to, const void* from, std::size_t size) { __real_memcpy(to, from, size); }

namespace {

// Is `fd` of a bell, ring it. The kernel orders rings among themselves; whatever else it orders is
// not relied upon.
void ring(int fd) {
  const auto bell = bells.find(fd);
  if (bell != bells.end()) bell->second->exchange(1, std::memory_order_relaxed);
}

}  // namespace
}  // namespace explore

namespace shm {

using explore::Image;

FileDescriptor make_segment(const char*, std::size_t size) {
  const Image::Outside outside;
  const int fd = explore::next_segment++;
  explore::segments[fd] = {Image::allocate_pages(size), size};
  return FileDescriptor(fd);
}
void seal(const FileDescriptor&, Seals) {}
std::error_code allocate(const FileDescriptor&, std::size_t, std::size_t) noexcept { return {}; }
void make_resident(const Mapping&, std::size_t, std::size_t, Residence) {}
void make_written_resident(const FileDescriptor&, const Mapping&, Residence) {}
FileDescriptor reopen(const FileDescriptor& segment, int) {
  const Image::Outside outside;
  const int fd = explore::next_segment++;
  explore::segments[fd] = explore::segments.at(segment.get());
  return FileDescriptor(fd);
}
std::size_t checked_size(const FileDescriptor& segment, Seals) {
  return explore::segments.at(segment.get()).size;
}
SegmentIdentity identity_of(const FileDescriptor& segment) {
  const auto base = reinterpret_cast<std::uintptr_t>(explore::segments.at(segment.get()).base);
  return {0, static_cast<ino_t>(base)};
}
std::size_t allocated_size(const FileDescriptor& segment) noexcept {
  return explore::segments.at(segment.get()).size;
}
std::size_t end_of_data(const FileDescriptor& segment, std::size_t) noexcept {
  return explore::segments.at(segment.get()).size;
}
bool copy_out(const FileDescriptor&, std::size_t, void*, std::size_t) noexcept { return false; }

namespace {

class MemoryMappable {
 public:
  explicit MemoryMappable(int fd) noexcept : handle_{fd, false} {}
  [[nodiscard]] boost::interprocess::mapping_handle_t get_mapping_handle() const { return handle_; }

 private:
  boost::interprocess::mapping_handle_t handle_;
};

}  // namespace

Mapping::Mapping(const FileDescriptor& segment, std::size_t size, Access access) {
  namespace bip = boost::interprocess;
  bip::mapped_region region(MemoryMappable(segment.get()),
                            access == Access::kReadOnly ? bip::read_only : bip::read_write, 0,
                            size);
  region_.swap(region);
}

void Mapping::replace(const FileDescriptor& segment) {
  *this = Mapping(segment, size(), Access::kReadOnly);
}

// Nothing is forked here.
Bequest::Bequest(void* address, std::size_t size, Kind kind, const std::uint32_t* users)
    : address_(address), size_(size), kind_(kind), users_(users) {}
Bequest::~Bequest() = default;
void close_in_children(const FileDescriptor&) {}

// A real descriptor, which epoll takes, that is never readable; and a word in the image.
Bell::Bell() : read_(eventfd(0, EFD_CLOEXEC)), write_(eventfd(0, EFD_CLOEXEC)) {
  auto* const rung = new Atomic<std::uint32_t>(0);
  const Image::Outside outside;
  explore::bells[read_.get()] = explore::bells[write_.get()] = rung;
}

void Bell::wait(Nanoseconds deadline) const noexcept {
  auto* const explorer = explore::Explorer::current();
  if (explorer == nullptr) return;
  const Atomic<std::uint32_t>* const rung = explore::bells.at(read_.get());
  explorer->wait_until(
      [rung, deadline] {
        return rung->load(std::memory_order_relaxed) != 0 || explore::virtual_time() >= deadline;
      },
      deadline);
}
void Bell::silence() const noexcept {
  explore::bells.at(read_.get())->exchange(0, std::memory_order_relaxed);
}

Ringer::Ringer(const FileDescriptor& write_end) : write_(explore::kFirstRinger + write_end.get()) {
  const Image::Outside outside;
  explore::bells[write_.get()] = explore::bells.at(write_end.get());
}
void Ringer::ring() const noexcept { explore::ring(write_.get()); }
bool Ringer::is_deserted() const noexcept { return false; }
void ring_bell(int write_end) noexcept { explore::ring(write_end); }

}  // namespace shm
}  // namespace arbiter

extern "C" {

void* __wrap_mmap(void* at, std::size_t size, int protection, int flags, int fd, off_t offset) {
  using namespace arbiter::explore;
  const auto segment = segments.find(fd);
  if (segment == segments.end()) return __real_mmap(at, size, protection, flags, fd, offset);
  return segment->second.base + offset;
}

int __wrap_munmap(void* at, std::size_t size) {
  return arbiter::explore::Image::owns(at) ? 0 : __real_munmap(at, size);
}

int __wrap_clock_gettime(clockid_t, timespec* time) {
  const auto reading = arbiter::explore::now.fetch_add(1, std::memory_order_relaxed);
  *time = {reading / 1'000'000'000, reading % 1'000'000'000};
  return 0;
}

// A real descriptor, which epoll takes, that never expires; and a word in the image.
int __wrap_timerfd_create(int clock, int flags) {
  using namespace arbiter;
  explore::timer = new shm::Atomic<shm::Nanoseconds>(shm::kForever);
  return __real_timerfd_create(clock, flags);
}

int __wrap_timerfd_settime(int, int, const itimerspec* at, itimerspec*) {
  using namespace arbiter;
  const shm::Nanoseconds time = at->it_value.tv_sec * 1'000'000'000 + at->it_value.tv_nsec;
  explore::timer->store(time == 0 ? shm::kForever : time, std::memory_order_relaxed);
  return 0;
}

// A sample is copied into its slot: plain data, of which receivers must not be reading.
void* __wrap_memcpy(void* to, const void* from, std::size_t size) {
  auto* const explorer = arbiter::explore::Explorer::current();
  if (explorer != nullptr && arbiter::explore::Image::is_inside() &&
      arbiter::explore::Image::is_segment(to)) {
    explorer->write_plain(to);
  }
  return __real_memcpy(to, from, size);
}

}  // extern "C"
