// The floor of all that spins: one core writes a cache line, the other sees it.
#include <atomic>

#include "bench/harness/shared.hpp"
#include "bench/peers/spin.hpp"
#include "bench/peers/systems.hpp"
#include "shm/limits.hpp"

namespace arbiter::bench {
namespace {

struct Line {
  alignas(shm::kCacheLine) std::atomic<std::uint64_t> number{0};
};

struct Lines {
  Line ping;
  Line pong;
};

class CacheLineEndpoint : public Endpoint {
 public:
  CacheLineEndpoint(Line& out, const Line& in) : out_(out), in_(in) {}

  void send(std::uint64_t number) override { out_.number.store(number, std::memory_order_release); }
  std::uint64_t receive() override {
    spin_until([&] { return in_.number.load(std::memory_order_acquire) != last_; });
    last_ = in_.number.load(std::memory_order_relaxed);
    return last_;
  }

 private:
  Line& out_;
  const Line& in_;
  std::uint64_t last_ = 0;
};

class CacheLineSession : public Session {
 public:
  std::unique_ptr<Endpoint> open(Side side) override {
    if (side == Side::kInitiator) {
      return std::make_unique<CacheLineEndpoint>(lines_->ping, lines_->pong);
    }
    return std::make_unique<CacheLineEndpoint>(lines_->pong, lines_->ping);
  }

 private:
  Shared<Lines> lines_;
};

class CacheLineSystem : public System {
 public:
  [[nodiscard]] std::string name() const override { return kCacheLine; }
  [[nodiscard]] Role role() const override { return Role::kFloor; }
  [[nodiscard]] bool can(const Exchange& exchange) const override {
    return exchange.waiting == Waiting::kSpinning && exchange.bytes <= shm::kCacheLine;
  }
  std::unique_ptr<Session> prepare(const Exchange&) override {
    return std::make_unique<CacheLineSession>();
  }
};

}  // namespace

std::unique_ptr<System> cache_line_system() { return std::make_unique<CacheLineSystem>(); }

}  // namespace arbiter::bench
