#include "shm/bell.hpp"

#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <sys/stat.h>

#include <cerrno>
#include <stdexcept>
#include <system_error>

#include "shm/clock.hpp"
#include "shm/descendants.hpp"
#include "shm/foreign.hpp"
#include "shm/segment.hpp"

namespace arbiter::shm {
namespace {

// A write to a pipe whose reader has died raises SIGPIPE in the writing thread, and pipes know no
// flag against it. The two calls around the write cost about 0.2 us of the 5 us that a wake-up
// takes.
class SigpipeGuard {
 public:
  SigpipeGuard() noexcept {
    sigemptyset(&sigpipe_);
    sigaddset(&sigpipe_, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &sigpipe_, &before_);
  }
  SigpipeGuard(const SigpipeGuard&) = delete;
  SigpipeGuard& operator=(const SigpipeGuard&) = delete;
  ~SigpipeGuard() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

  // Takes the signal that a failed write left pending, unless the thread had it blocked itself.
  void discard() const noexcept {
    if (sigismember(&before_, SIGPIPE) == 1) return;
    const timespec at_once{};
    while (sigtimedwait(&sigpipe_, nullptr, &at_once) < 0 && errno == EINTR) {
    }
  }

 private:
  sigset_t sigpipe_;
  sigset_t before_;
};

}  // namespace

Bell::Bell() {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0) {
    throw std::system_error(errno, std::generic_category(), "making a bell");
  }
  read_.reset(ends[0]);
  write_.reset(ends[1]);
  close_in_children(read_);
  close_in_children(write_);
  if (fchmod(write_.get(), 0222) != 0) {
    throw std::system_error(errno, std::generic_category(), "making a bell write-only");
  }
  for_publishers_ = reopen(write_, O_WRONLY | O_NONBLOCK);
}

void Bell::wait(Nanoseconds deadline) const noexcept {
  pollfd bell{read_.get(), POLLIN, 0};
  if (deadline == kForever) {
    ppoll(&bell, 1, nullptr, nullptr);
    return;
  }
  const Nanoseconds left = deadline - monotonic_now();
  if (left <= 0) return;
  const timespec timeout{left / 1'000'000'000, left % 1'000'000'000};
  ppoll(&bell, 1, &timeout, nullptr);
}

// Bounded, for a publisher that rings without end must not keep us here. What is left of a pipe
// that somebody has made larger is taken for a new ring, no more.
void Bell::silence() const noexcept {
  constexpr int kMaxReads = 16;  // 64 KiB, what a pipe holds
  char rings[4096];
  for (int i = 0; i < kMaxReads; ++i) {
    if (::read(read_.get(), rings, sizeof rings) != static_cast<ssize_t>(sizeof rings)) return;
  }
}

Ringer::Ringer(const FileDescriptor& write_end) {
  if (foreign_kind(write_end.get()) != ForeignKind::kPipe) {
    throw std::runtime_error("the bell is not a pipe");
  }
  write_ = reopen(write_end, O_WRONLY | O_NONBLOCK);
  close_in_children(write_);
}

void Ringer::ring() const noexcept { ring_bell(write_.get()); }

bool Ringer::is_deserted() const noexcept {
  pollfd bell{write_.get(), 0, 0};
  return ::poll(&bell, 1, 0) == 1 && (bell.revents & POLLERR) != 0;
}

void ring_bell(int write_end) noexcept {
  const int saved = errno;
  const SigpipeGuard guard;
  const char ring = 1;
  while (::write(write_end, &ring, 1) < 0) {
    if (errno == EINTR) continue;
    if (errno == EPIPE) guard.discard();
    break;
  }
  errno = saved;
}

}  // namespace arbiter::shm
