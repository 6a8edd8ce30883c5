#include "gateway/core/stop_signals.hpp"

#include <signal.h>
#include <sys/signalfd.h>

namespace arbiter::gateway {

shm::FileDescriptor catch_stop_signals() {
  sigset_t caught;
  sigemptyset(&caught);
  for (const int number : {SIGTERM, SIGINT}) sigaddset(&caught, number);
  // A signal that is blocked is read here even if it is ignored.
  struct sigaction hangup {};
  if (sigaction(SIGHUP, nullptr, &hangup) != 0 || hangup.sa_handler != SIG_IGN) {
    sigaddset(&caught, SIGHUP);
  }
  sigprocmask(SIG_BLOCK, &caught, nullptr);
  for (const int number : {SIGPIPE, SIGXFSZ}) signal(number, SIG_IGN);
  return shm::FileDescriptor(signalfd(-1, &caught, SFD_CLOEXEC | SFD_NONBLOCK));
}

shm::FileDescriptor catch_reload_signal() {
  sigset_t caught;
  sigemptyset(&caught);
  sigaddset(&caught, SIGUSR1);
  sigprocmask(SIG_BLOCK, &caught, nullptr);
  return shm::FileDescriptor(signalfd(-1, &caught, SFD_CLOEXEC | SFD_NONBLOCK));
}

}  // namespace arbiter::gateway
