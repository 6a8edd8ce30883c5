// How `arbiter record --dump` reaches a running flight recorder: a socket beside its files,
// PREFIX.sock, which only its user may use.
//
// Whoever connects asks for a file by that, and is answered with one line: "written PATH", or
// "failed WHY".
#pragma once

#include <string>
#include <vector>

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
  // Takes in who asks; false: nobody does. Does not wait.
  bool accept();
  // Answers all who have asked.
  void answer(const std::string& line);

 private:
  const std::string path_;
  shm::FileDescriptor lock_;  // PREFIX.lock: one recorder at a time
  shm::FileDescriptor listener_;
  std::vector<shm::FileDescriptor> asking_;
};

// Asks the recorder with that prefix, and waits for its answer. Throws std::runtime_error where
// there is none.
[[nodiscard]] std::string ask_for_dump(const std::string& prefix);

}  // namespace arbiter::recorder
