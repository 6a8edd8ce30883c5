// How a receiver that waits is woken.
//
// A pipe whose write end every publisher opens for itself, write-only and non-blocking. An eventfd
// would do, but whoever may write it may also read it empty, or switch it to blocking, for all
// others. The pipe's mode is 0222, so that opening it anew gives no way to read.
#pragma once

#include "shm/activity.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::shm {

// The receiver's side.
class Bell {
 public:
  // Throws std::system_error.
  Bell();

  // Blocks until the bell rings or CLOCK_MONOTONIC reaches `deadline` (kForever: no limit). May
  // also return early. One system call.
  void wait(Nanoseconds deadline) const noexcept;
  // Forgets all rings so far.
  void silence() const noexcept;

  [[nodiscard]] int read_end() const noexcept { return read_.get(); }
  // For the port's own threads.
  [[nodiscard]] const FileDescriptor& write_end() const noexcept { return write_; }
  // For publishers, who reopen it. Whoever has it may make its writes block, not those of ours.
  [[nodiscard]] const FileDescriptor& for_publishers() const noexcept { return for_publishers_; }

 private:
  FileDescriptor read_;
  FileDescriptor write_;
  FileDescriptor for_publishers_;
};

// The publishers' side.
class Ringer {
 public:
  Ringer() = default;
  // Opens the pipe anew. Throws std::system_error; std::runtime_error where it is none.
  explicit Ringer(const FileDescriptor& write_end);

  // Never blocks; a full pipe is rung already, and one without a reader raises no SIGPIPE.
  void ring() const noexcept;
  // Whether nobody can hear it any more: its reader has closed it, or died.
  [[nodiscard]] bool is_deserted() const noexcept;

 private:
  FileDescriptor write_;
};

// Rings through a descriptor at hand.
void ring_bell(int write_end) noexcept;

}  // namespace arbiter::shm
