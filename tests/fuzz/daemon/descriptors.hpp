// What the hostile ones send with their messages: descriptors of any kind, good and bad.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "shm/bell.hpp"
#include "shm/segment.hpp"
#include "tests/fuzz/script.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::fuzz {

class Descriptors {
 public:
  // What a hostile process has of its own.
  struct Owner {
    int process;  // an end of a pipe
    int socket;   // its connection
  };

  explicit Descriptors(Script& script) : script_(script) {}

  // As many as the script says; none if one cannot be made.
  std::vector<int> some(const Owner& owner);
  int make(shm::FileDescriptor descriptor);
  [[nodiscard]] int bell() const { return bell_.write_end().get(); }

  // What the daemon has given to any of them.
  void keep(shm::FileDescriptor descriptor);
  [[nodiscard]] int given(std::size_t index) const;

  // They have made it themselves.
  [[nodiscard]] bool is_made(int descriptor) const;
  void close();

 private:
  int one(const Owner& owner);
  int segment();
  int pipe();
  int fifo(std::uint8_t kind);
  int queued(const Owner& owner);

  Script& script_;
  const test::TemporaryDirectory names_;
  const shm::Bell bell_;
  std::vector<shm::FileDescriptor> given_;
  std::vector<shm::FileDescriptor> made_;
};

}  // namespace arbiter::fuzz
