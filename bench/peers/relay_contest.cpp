#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "bench/peers/contest.hpp"
#include "bench/peers/relay.hpp"

namespace arbiter::bench {
namespace {

// As Arbiter's: the old winner's rule reads the override and seven others.
std::vector<Relay::Source> sources() {
  std::vector<std::string> sensed;
  for (int i = 1; i <= 7; ++i) sensed.push_back("s" + std::to_string(i));
  std::vector<std::string> overrides = sensed;
  overrides.emplace_back("override");
  std::vector<Relay::Source> all{{"old", none_of(overrides), 0}, {"override", "true", 0}};
  for (const std::string& each : sensed) all.push_back({each, "", 0});
  return all;
}

RelayOptions options(const Contest& contest) {
  RelayOptions options;
  options.bytes = sizeof(ContestSample);
  options.timeout_ns = contest.timeout_ns;
  options.tells_idle = contest.falls_silent;
  return options;
}

class RelaySources : public Sources {
 public:
  explicit RelaySources(const Relay& relay) : relay_(relay) {}

  void publish(Party party, std::uint64_t number) override {
    const ContestSample sample{static_cast<std::uint64_t>(party), number, {}};
    send(party, &sample, sizeof sample);
  }
  void release() override { send(Party::kOverride, nullptr, 0); }

 private:
  void send(Party party, const void* data, std::size_t size) {
    if (::send(relay_.to(static_cast<std::size_t>(party)), data, size, 0) < 0) {
      throw std::system_error(errno, std::generic_category(), "send");
    }
  }

  const Relay& relay_;
};

class RelayDestination : public Destination {
 public:
  explicit RelayDestination(int socket) : socket_(socket) {
    const timeval patience{1, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }

  Taken take() override { return receive(MSG_DONTWAIT); }
  Taken wait() override { return receive(0); }

 private:
  Taken receive(int flags) {
    ContestSample sample;
    const ssize_t size = ::recv(socket_, &sample, sizeof sample, flags);
    if (size == sizeof sample) return taken(sample);
    return {size == 0 ? Taken::Kind::kIdle : Taken::Kind::kNothing};
  }

  int socket_;
};

class RelayContest : public ContestSession {
 public:
  explicit RelayContest(const Contest& contest) : relay_(sources(), 1, options(contest)) {}

  std::unique_ptr<Sources> open_sources() override {
    return std::make_unique<RelaySources>(relay_);
  }
  std::unique_ptr<Destination> open_destination() override {
    return std::make_unique<RelayDestination>(relay_.from(0));
  }

 private:
  Relay relay_;
};

}  // namespace

std::unique_ptr<ContestSession> relay_contest(const Contest& contest) {
  return std::make_unique<RelayContest>(contest);
}

}  // namespace arbiter::bench
