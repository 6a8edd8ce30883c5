#include "cli/broken_pipe.hpp"

#include <poll.h>
#include <signal.h>
#include <unistd.h>

namespace arbiter::cli {

bool has_reader_gone() {
  pollfd out{STDOUT_FILENO, 0, 0};  // POLLERR and POLLHUP are told unasked
  return ::poll(&out, 1, 0) == 1 && (out.revents & (POLLERR | POLLHUP)) != 0;
}

void end_by_broken_pipe() {
  sigset_t mine;
  sigemptyset(&mine);
  sigaddset(&mine, SIGPIPE);
  ::signal(SIGPIPE, SIG_DFL);
  ::pthread_sigmask(SIG_UNBLOCK, &mine, nullptr);
  ::raise(SIGPIPE);
  ::_exit(128 + SIGPIPE);
}

}  // namespace arbiter::cli
