// Who has all hosts switch to another model: `arbiter switch NAME --all`, or, where a link is to
// die between the two halves of it, a program of our own that does the same.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/link/failures/history.hpp"
#include "tests/link/failures/host.hpp"

namespace arbiter::failures {

class Operators {
 public:
  // At that host.
  void start(const FailingHost& at, unsigned model);
  // `victim`: whose link is killed when all hosts have promised, and none has been told to commit.
  void start_killer(const FailingHost& at, unsigned model, FailingHost& victim);
  // Notes who has ended; often, for the times count.
  void reap() { reap(false); }
  // Whether one of the latter is still at it.
  [[nodiscard]] bool has_killer() const;
  // Waits for all, and returns what each of them was told.
  [[nodiscard]] std::vector<SwitchTried> end();

 private:
  struct One {
    SwitchTried tried;
    shm::FileDescriptor output;
    test::ChildProcess process;
  };
  void start(const FailingHost& at, unsigned model, std::vector<std::string> command,
             unsigned victim);
  void reap(bool all);

  std::vector<One> ongoing_;
  std::vector<SwitchTried> ended_;
};

// The program of our own: --switch MODEL --component INSTANCE --kill PID. Returns an exit code of
// `arbiter switch --all`.
int switch_and_kill(const std::string& instance, const std::string& model, int pid);

}  // namespace arbiter::failures
