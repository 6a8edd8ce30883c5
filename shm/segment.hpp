// Memory shared between processes: made by its one writer, sealed, and handed on to be read.
//
// A segment is a memfd: it has no name to leak or to guess, and lives as long as somebody maps it
// or holds its descriptor. Two kinds of owners:
//   - a component's own segment is sealed once its owner has mapped it: nobody, not even the owner,
//     can shrink or grow it, nor make another writable mapping (F_SEAL_FUTURE_WRITE);
//   - what must pass to a successor (the daemon's board, the activity pages) stays unsealed against
//     writing, belongs to the daemon, and is handed out read-only except to its one writer.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <system_error>

#include <boost/interprocess/mapped_region.hpp>

#include "shm/file_descriptor.hpp"

namespace arbiter::shm {

// Of one port: a process of 128 TiB of addresses can map those of 8192 peers.
inline constexpr std::size_t kMaxSegmentSize = std::size_t{16} << 30;

enum class Seals {
  kFixedSize,  // cannot shrink or grow
  kOneWriter,  // and cannot be mapped writable again
};

// Makes a zeroed memfd, `size` bytes long, mode 0644. Its memory is allocated as it is touched;
// call allocate() for what must never fault. Throws std::system_error.
FileDescriptor make_segment(const char* name, std::size_t size);

// Throws std::system_error.
void seal(const FileDescriptor& segment, Seals seals);

// Allocates the memory of a byte range now, so that using it later cannot fail for want of memory.
[[nodiscard]] std::error_code allocate(const FileDescriptor& segment, std::size_t offset,
                                       std::size_t bytes) noexcept;

// Opens the same segment once more, read-only or read-write, as far as its mode lets this user.
// Never waits: its maker may hold a lease on it (F_SETLEASE), and would keep an ordinary open()
// waiting for 45 seconds. Throws std::system_error, std::runtime_error.
FileDescriptor reopen(const FileDescriptor& segment, int flags);

// The size of a segment that somebody else made, once it is sure that it is a memfd that can
// neither shrink nor grow under us, nor be written by anyone but its owner. Throws
// std::runtime_error with what is wrong with it.
std::size_t checked_size(const FileDescriptor& segment, Seals wanted);

// Which segment it is: the same for all descriptors of one, and another for each that lives. Throws
// std::system_error.
struct SegmentIdentity {
  dev_t device = 0;
  ino_t inode = 0;

  friend bool operator==(const SegmentIdentity&, const SegmentIdentity&) = default;
};
SegmentIdentity identity_of(const FileDescriptor& segment);
// Whether both descriptors are of the same memory.
[[nodiscard]] bool are_one_segment(const FileDescriptor& one, const FileDescriptor& other) noexcept;

// How much of a foreign segment is allocated, once checked_size() has passed. It never falls where
// a segment is sealed to its size and its one writer: it can be truncated no more, nor holes be
// punched into it, not even through its owner's own mapping. What was paged out counts. Takes no
// lock that its owner could hold.
[[nodiscard]] std::size_t allocated_size(const FileDescriptor& segment) noexcept;

// Where the data that stands at `offset` ends: the next hole, or the end. `offset` itself where it
// is a hole. Through a descriptor of our own; waits while the owner changes what is allocated.
[[nodiscard]] std::size_t end_of_data(const FileDescriptor& segment, std::size_t offset) noexcept;

// Copies a range of a segment out of it, holes as zeros: unlike a load, that allocates nothing.
// False: not all of it is there.
[[nodiscard]] bool copy_out(const FileDescriptor& segment, std::size_t offset, void* to,
                            std::size_t bytes) noexcept;

enum class Access { kReadOnly, kReadWrite };

// A mapping of a whole segment. Writable ones are not inherited by a fork: a child that ran on with
// them would be a second writer.
class Mapping {
 public:
  Mapping() = default;
  // Throws std::system_error.
  Mapping(const FileDescriptor& segment, std::size_t size, Access access);

  // Another segment of the same size takes its place, read-only, at the same address. Who reads
  // there meanwhile reads the one or the other. Throws std::system_error; then it is as before.
  void replace(const FileDescriptor& segment);

  [[nodiscard]] std::byte* data() const noexcept {
    return static_cast<std::byte*>(region_.get_address());
  }
  [[nodiscard]] std::size_t size() const noexcept { return region_.get_size(); }
  template <class T>
  [[nodiscard]] T* as(std::size_t offset = 0) const noexcept {
    return reinterpret_cast<T*>(data() + offset);
  }

 private:
  boost::interprocess::mapped_region region_;
};

}  // namespace arbiter::shm
