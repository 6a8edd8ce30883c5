// The floor of waking a process without a descriptor.
#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>

#include "bench/harness/shared.hpp"
#include "bench/peers/systems.hpp"
#include "shm/limits.hpp"

namespace arbiter::bench {
namespace {

struct Word {
  alignas(shm::kCacheLine) std::atomic<std::uint32_t> value{0};
};

struct Words {
  Word ping;
  Word pong;
};

long futex(std::atomic<std::uint32_t>& word, int operation, std::uint32_t value) {
  return ::syscall(SYS_futex, &word, operation, value, nullptr, nullptr, 0);
}

class FutexEndpoint : public Endpoint {
 public:
  FutexEndpoint(Word& out, Word& in) : out_(out.value), in_(in.value) {}

  void send(std::uint64_t number) override {
    out_.store(static_cast<std::uint32_t>(number), std::memory_order_release);
    futex(out_, FUTEX_WAKE, 1);
  }
  std::uint64_t receive() override {
    while (in_.load(std::memory_order_acquire) == last_) futex(in_, FUTEX_WAIT, last_);
    last_ = in_.load(std::memory_order_relaxed);
    return last_;
  }

 private:
  std::atomic<std::uint32_t>& out_;
  std::atomic<std::uint32_t>& in_;
  std::uint32_t last_ = 0;
};

class FutexSession : public Session {
 public:
  std::unique_ptr<Endpoint> open(Side side) override {
    if (side == Side::kInitiator) {
      return std::make_unique<FutexEndpoint>(words_->ping, words_->pong);
    }
    return std::make_unique<FutexEndpoint>(words_->pong, words_->ping);
  }

 private:
  Shared<Words> words_;
};

class FutexSystem : public System {
 public:
  [[nodiscard]] std::string name() const override { return "futex"; }
  [[nodiscard]] Role role() const override { return Role::kFloor; }
  [[nodiscard]] bool can(const Exchange& exchange) const override {
    return exchange.waiting == Waiting::kBlocking && exchange.bytes <= shm::kCacheLine;
  }
  std::unique_ptr<Session> prepare(const Exchange&) override {
    return std::make_unique<FutexSession>();
  }
};

}  // namespace

std::unique_ptr<System> futex_system() { return std::make_unique<FutexSystem>(); }

}  // namespace arbiter::bench
