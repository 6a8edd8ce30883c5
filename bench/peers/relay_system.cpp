#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "bench/peers/relay.hpp"
#include "bench/peers/systems.hpp"

namespace arbiter::bench {
namespace {

class RelayEndpoint : public Endpoint {
 public:
  RelayEndpoint(int out, int in, std::size_t bytes) : out_(out), in_(in), buffer_(bytes) {
    const timeval patience{10, 0};
    ::setsockopt(in_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }

  void send(std::uint64_t number) override {
    std::memcpy(buffer_.data(), &number, sizeof number);
    if (::write(out_, buffer_.data(), buffer_.size()) < 0) {
      throw std::system_error(errno, std::generic_category(), "write");
    }
  }
  std::uint64_t receive() override {
    if (::read(in_, buffer_.data(), buffer_.size()) <= 0) {
      throw BenchError("no sample has come for ten seconds");
    }
    std::uint64_t number = 0;
    std::memcpy(&number, buffer_.data(), sizeof number);
    return number;
  }

 private:
  int out_;
  int in_;
  std::vector<std::byte> buffer_;
};

// As Arbiter's: either rule reads eight activities.
std::vector<Relay::Source> sources() {
  std::vector<std::string> sensed;
  for (int i = 1; i <= 8; ++i) sensed.push_back("s" + std::to_string(i));
  std::vector<Relay::Source> all{{"ping", none_of(sensed), 0}, {"pong", none_of(sensed), 1}};
  for (const std::string& each : sensed) all.push_back({each, "", 0});
  return all;
}

class RelaySession : public Session {
 public:
  explicit RelaySession(const Exchange& exchange)
      : bytes_(exchange.bytes), relay_(sources(), 2, options(exchange)) {}

  std::unique_ptr<Endpoint> open(Side side) override {
    const bool initiates = side == Side::kInitiator;
    return std::make_unique<RelayEndpoint>(relay_.to(initiates ? 0 : 1),
                                           relay_.from(initiates ? 1 : 0), bytes_);
  }

 private:
  static RelayOptions options(const Exchange& exchange) {
    RelayOptions options;
    options.bytes = exchange.bytes;
    return options;
  }

  std::size_t bytes_;
  Relay relay_;
};

class RelaySystem : public System {
 public:
  [[nodiscard]] std::string name() const override { return kRelay; }
  [[nodiscard]] Role role() const override { return Role::kPeer; }
  // Its ends block: with three processes on few cores, one that spins keeps the relay from running.
  [[nodiscard]] bool can(const Exchange& exchange) const override {
    constexpr std::size_t kLargestDatagram = 128 * 1024;
    return exchange.waiting == Waiting::kBlocking && exchange.bytes <= kLargestDatagram;
  }
  std::unique_ptr<Session> prepare(const Exchange& exchange) override {
    return std::make_unique<RelaySession>(exchange);
  }
};

}  // namespace

std::unique_ptr<System> relay_system() { return std::make_unique<RelaySystem>(); }

}  // namespace arbiter::bench
