// Processes that are forked from this one, and do not call exec: they must not act in its name, and
// must not keep alive what others pay for.
//
// A child gets a copy of all that its parent has. Of that
//   - it can tell that it is not the parent (ProcessMark), at the cost of a load;
//   - shared memory that its parent may write is not there (Mapping); it may be given private pages
//     of zeros in its place, so that using what its parent has left there harms nobody;
//   - shared memory of others is unmapped, but for what the component was reading at the fork;
//   - descriptors that the parent has named are closed.
//
// The kernel sees to the first, and that writable memory is not inherited. The rest is done by a
// handler of pthread_atfork(), which a bare clone() passes by: such a child has no pages of zeros,
// and keeps what it has inherited until it ends.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>

#include "shm/file_descriptor.hpp"

namespace arbiter::shm {

// Which process this is. A copy of the mark, in whatever memory, is here in the process that made
// it, and in none of its descendants.
class ProcessMark {
 public:
  // Throws std::system_error.
  static ProcessMark of_this_process();

  ProcessMark() = default;
  // No atomic: no thread writes the word once it is set. A child finds it wiped.
  [[nodiscard]] bool is_here() const noexcept { return *word_ != 0; }
  // The same, seeing also through a child that shares its parent's memory (vfork). A system call.
  [[nodiscard]] bool is_surely_here() const noexcept;
  // Of the process that made it.
  [[nodiscard]] pid_t process() const noexcept { return process_; }

 private:
  ProcessMark(const std::uint8_t* word, pid_t process) noexcept : word_(word), process_(process) {}

  const std::uint8_t* word_ = nullptr;
  pid_t process_ = 0;
};

// What becomes of a mapping in a child, for as long as this lives.
class Bequest {
 public:
  enum class Kind : std::uint8_t {
    kPrivateZeros,      // it is not inherited, and zeros take its place
    kNothing,           // unmapped
    kNothingUnlessUsed  // the same, unless `users` is not 0
  };
  Bequest(void* address, std::size_t size, Kind kind, const std::uint32_t* users = nullptr);
  Bequest(const Bequest&) = delete;
  Bequest& operator=(const Bequest&) = delete;
  ~Bequest();

 private:
  friend struct Bequests;

  void settle() const noexcept;

  void* const address_;
  const std::size_t size_;
  const Kind kind_;
  const std::uint32_t* const users_;
  Bequest* next_ = nullptr;
  Bequest** before_ = nullptr;  // what points to it; null once it is settled
};

// Children close it, unless it is closed, or released, before.
void close_in_children(const FileDescriptor& descriptor);

}  // namespace arbiter::shm
