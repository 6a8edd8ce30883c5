// Runs an attack in a process of its own, as another user where that is wanted, and tells what came
// of it.
#pragma once

#include <fcntl.h>
#include <grp.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <stdexcept>
#include <string>

#include "shm/file_descriptor.hpp"

namespace arbiter::test {

inline constexpr uid_t kStrangersId = 65534;
inline constexpr int kFewDescriptors = 400;  // of a daemon that is to run out of them

enum class As { kSameUser, kAnotherUser };

struct Attacked {
  int signal = 0;    // that ended it
  std::string said;  // what succeeded
};

inline Attacked run_attack(As who, const std::function<std::string()>& attack) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("pipe2");
  shm::FileDescriptor in(ends[0]);
  shm::FileDescriptor out(ends[1]);
  const pid_t child = ::fork();
  if (child == 0) {
    if (who == As::kAnotherUser) {
      const bool changed = ::setgroups(0, nullptr) == 0 &&
                           ::setresgid(kStrangersId, kStrangersId, kStrangersId) == 0 &&
                           ::setresuid(kStrangersId, kStrangersId, kStrangersId) == 0;
      if (!changed) ::_exit(1);
      ::prctl(PR_SET_DUMPABLE, 1);  // or its own /proc would be closed to it
    }
    const std::string said = "done " + attack();
    ::_exit(::write(out.get(), said.data(), said.size()) < 0 ? 1 : 0);
  }
  out.reset();
  Attacked result;
  char buffer[1024];
  for (ssize_t size = 0; (size = ::read(in.get(), buffer, sizeof buffer)) > 0;) {
    result.said.append(buffer, static_cast<std::size_t>(size));
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  return result;
}

}  // namespace arbiter::test
