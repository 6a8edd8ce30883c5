#include "bench/harness/interruption.hpp"

#include <signal.h>

#include <atomic>

namespace arbiter::bench {
namespace {

std::atomic<bool> is_interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);  // a signal handler writes it

}  // namespace

void remember_interruptions() {
  struct sigaction action {};
  action.sa_handler = [](int) { is_interrupted = true; };
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

void throw_if_interrupted() {
  if (is_interrupted) throw Interrupted();
}

}  // namespace arbiter::bench
