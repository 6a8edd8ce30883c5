#include "bench/harness/interruption.hpp"

#include <signal.h>
#include <time.h>

#include <atomic>
#include <cerrno>

namespace arbiter::bench {
namespace {

std::atomic<bool> is_interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);  // a signal handler writes it

// Keeps the two signals back.
class Deferred {
 public:
  Deferred() {
    sigset_t both;
    ::sigemptyset(&both);
    ::sigaddset(&both, SIGINT);
    ::sigaddset(&both, SIGTERM);
    ::pthread_sigmask(SIG_BLOCK, &both, &before_);
  }
  Deferred(const Deferred&) = delete;
  Deferred& operator=(const Deferred&) = delete;
  ~Deferred() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

  [[nodiscard]] const sigset_t& before() const { return before_; }

 private:
  sigset_t before_{};
};

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

int poll_or_throw(pollfd& polled, int milliseconds) {
  const Deferred deferred;
  throw_if_interrupted();
  const timespec time{milliseconds / 1000, milliseconds % 1000 * 1'000'000L};
  const int ready = ::ppoll(&polled, 1, &time, &deferred.before());
  if (ready < 0 && errno == EINTR) throw_if_interrupted();
  return ready;
}

}  // namespace arbiter::bench
