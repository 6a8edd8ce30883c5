#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "bench/harness/cpu.hpp"
#include "bench/peers/contest.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::bench {
namespace {

class PipeSources : public Sources {
 public:
  PipeSources(int pipe, std::int64_t timeout_ns) : pipe_(pipe), timeout_ns_(timeout_ns) {}

  void publish(Party party, std::uint64_t number) override {
    const std::int64_t now = now_ns();
    if (party == Party::kOverride) expiry_ = now + timeout_ns_;
    if (party == Party::kOld && now < expiry_) return;
    const ContestSample sample{static_cast<std::uint64_t>(party), number, {}};
    if (::write(pipe_, &sample, sizeof sample) < 0) {
      throw std::system_error(errno, std::generic_category(), "write");
    }
  }
  void release() override { expiry_ = 0; }

 private:
  int pipe_;
  std::int64_t timeout_ns_;
  std::int64_t expiry_ = 0;
};

class PipeDestination : public Destination {
 public:
  PipeDestination(int pipe, std::int64_t timeout_ns) : pipe_(pipe), timeout_ns_(timeout_ns) {}

  Taken take() override {
    ContestSample sample;
    if (::read(pipe_, &sample, sizeof sample) != sizeof sample) return {};
    expiry_ = static_cast<Party>(sample.party) == Party::kOverride ? now_ns() + timeout_ns_ : 0;
    return taken(sample);
  }
  Taken wait() override {
    const std::int64_t now = now_ns();
    const std::int64_t left = expiry_ == 0 ? 1'000'000'000 : std::max(expiry_ - now, INT64_C(0));
    const timespec timeout{left / 1'000'000'000, left % 1'000'000'000};
    pollfd readable{pipe_, POLLIN, 0};
    if (::ppoll(&readable, 1, &timeout, nullptr) > 0) return take();
    if (expiry_ == 0) return {};
    expiry_ = 0;
    return {Taken::Kind::kIdle};
  }

 private:
  int pipe_;
  std::int64_t timeout_ns_;
  std::int64_t expiry_ = 0;  // of the override, or 0
};

class PipeContest : public ContestSession {
 public:
  explicit PipeContest(const Contest& contest) : timeout_ns_(contest.timeout_ns) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0) {
      throw std::system_error(errno, std::generic_category(), "pipe");
    }
    read_ = shm::FileDescriptor(ends[0]);
    write_ = shm::FileDescriptor(ends[1]);
  }

  std::unique_ptr<Sources> open_sources() override {
    return std::make_unique<PipeSources>(write_.get(), timeout_ns_);
  }
  std::unique_ptr<Destination> open_destination() override {
    return std::make_unique<PipeDestination>(read_.get(), timeout_ns_);
  }

 private:
  std::int64_t timeout_ns_;
  shm::FileDescriptor read_;
  shm::FileDescriptor write_;
};

}  // namespace

std::unique_ptr<ContestSession> pipe_and_timer(const Contest& contest) {
  return std::make_unique<PipeContest>(contest);
}

}  // namespace arbiter::bench
