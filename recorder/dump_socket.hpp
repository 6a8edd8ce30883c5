// How `arbiter record --dump` reaches a running flight recorder: a socket beside its files,
// PREFIX.sock, which only its user may use.
//
// Whoever connects asks for a file by that, and is answered with one line: "written PATH", or
// "failed WHY". Each who asks has a number, so that nobody is answered with what another has asked
// for.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "shm/activity.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::recorder {

class DumpSocket {
 public:
  // Throws std::runtime_error where another recorder has it, or it cannot be made.
  explicit DumpSocket(const std::string& prefix);
  DumpSocket(const DumpSocket&) = delete;
  DumpSocket& operator=(const DumpSocket&) = delete;
  ~DumpSocket();

  // Readable: somebody asks.
  [[nodiscard]] int descriptor() const { return listener_.get(); }
  // Takes in who asks, and gives each the number that `request` returns. Does not wait. Where many
  // wait for their answers, others stay at the door: call it again after answer().
  void accept(const std::function<std::uint64_t()>& request);
  void answer(std::uint64_t request, const std::string& line);

 private:
  const std::string path_;
  shm::FileDescriptor lock_;  // PREFIX.lock: one recorder at a time
  shm::FileDescriptor listener_;
  struct Asking {
    std::uint64_t request = 0;
    shm::FileDescriptor socket;
  };
  std::vector<Asking> asking_;
};

// Asks the recorder with that prefix, and waits for its answer, for `patience` at most. Throws
// std::runtime_error where there is none.
[[nodiscard]] std::string ask_for_dump(const std::string& prefix, shm::Nanoseconds patience);

}  // namespace arbiter::recorder
