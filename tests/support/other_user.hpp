// Code that runs as another user, in a child process; only root may start it.
#pragma once

#include <grp.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <exception>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/run_program.hpp"

namespace arbiter::test {

struct User {
  uid_t id;
  gid_t group = id;
  std::vector<gid_t> supplementary{};
};

// Users that no machine has accounts for, except that everybody has nobody.
inline const User kNobody{65534};
inline const User kStranger{54321};

inline bool may_be_another_user() { return ::geteuid() == 0; }

inline bool become(const User& user) {
  return ::setgroups(user.supplementary.size(), user.supplementary.data()) == 0 &&
         ::setresgid(user.group, user.group, user.group) == 0 &&
         ::setresuid(user.id, user.id, user.id) == 0;
}

// What `act` returns; the text of what it throws. Nothing else may run in this process by threads.
template <class Act>
std::string as_user(const User& user, Act act) {
  program_detail::Pipe answer;
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("fork");
  if (child == 0) {
    std::string said;
    try {
      said = become(user) ? act() : "cannot become that user";
    } catch (const std::exception& error) {
      said = error.what();
    }
    const ssize_t written = ::write(answer.ends[1], said.data(), said.size());
    ::_exit(written == static_cast<ssize_t>(said.size()) ? 0 : 1);
  }
  answer.close(1);
  std::string said;
  char buffer[4096];
  ssize_t count = 0;
  while ((count = ::read(answer.ends[0], buffer, sizeof buffer)) > 0 ||
         (count < 0 && errno == EINTR)) {
    if (count > 0) said.append(buffer, static_cast<std::size_t>(count));
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (status != 0) throw std::runtime_error("the child that was to be another user has died");
  return said;
}

}  // namespace arbiter::test
