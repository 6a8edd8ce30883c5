#include "bench/measures/ping_pong.hpp"

#include <unistd.h>

#include <algorithm>

#include "bench/harness/cpu.hpp"

namespace arbiter::bench {
namespace {

void expect(std::uint64_t number, std::uint64_t expected) {
  if (number == expected) return;
  throw BenchError("sample " + std::to_string(number) + " has come in place of " +
                   std::to_string(expected));
}

void settle(const PingPongOptions& options, int processor) {
  pin(processor);
  if (options.fifo_priority != 0) use_fifo(options.fifo_priority);
}

void respond(Conversation& with, Session& session, const PingPongOptions& options) {
  const auto endpoint = session.open(Side::kResponder);
  settle(options, 1);
  with.say(1);
  std::uint64_t number = 0;
  for (std::uint64_t times = 0; with.hear_or_end(times);) {
    with.say(1);
    for (; times != 0; --times) {
      const std::uint64_t heard = endpoint->receive();
      expect(heard, ++number);
      endpoint->send(number);
    }
  }
}

void initiate(Conversation& with, Session& session, const PingPongOptions& options) {
  const auto endpoint = session.open(Side::kInitiator);
  settle(options, 0);
  with.say(1);
  std::uint64_t number = 0;
  for (std::uint64_t times = 0; with.hear_or_end(times);) {
    Histogram one_way;
    std::int64_t before = now_ns();
    for (; times != 0; --times) {
      endpoint->send(++number);
      const std::uint64_t heard = endpoint->receive();
      expect(heard, number);
      const std::int64_t after = now_ns();
      one_way.add(static_cast<double>(after - before) / 2);
      before = after;
    }
    with.say(one_way);
  }
}

}  // namespace

PingPong::PingPong(System& system, const Exchange& exchange, const PingPongOptions& options)
    : session_(system.prepare(exchange)),
      responder_(system.name() + ", responder",
                 [this, options](Conversation& with) { respond(with, *session_, options); }),
      initiator_(system.name() + ", initiator",
                 [this, options](Conversation& with) { initiate(with, *session_, options); }) {
  responder_.hear();
  initiator_.hear();
}

Histogram PingPong::round(double seconds) {
  constexpr std::uint64_t kFirst = 50;
  const auto times =
      exchange_ns_ == 0
          ? kFirst
          : std::max(kFirst, static_cast<std::uint64_t>(seconds * 1e9 / exchange_ns_));
  responder_.say(times);
  responder_.hear();
  initiator_.say(times);
  Histogram seen = initiator_.hear_histogram();
  const bool is_first = exchange_ns_ == 0;
  exchange_ns_ = std::max(1.0, 2 * seen.mean());
  return is_first ? round(seconds) : seen;
}

std::vector<Contender> ping_pongs(const Systems& systems, const Exchange& exchange,
                                  std::vector<Result>& absent_ones,
                                  const PingPongOptions& options) {
  static int sessions = 0;
  std::vector<Contender> contenders;
  for (const auto& system : systems) {
    if (!system->can(exchange)) continue;
    Exchange own = exchange;
    own.unique = "arbiter-bench-" + std::to_string(::getpid()) + "-" + std::to_string(++sessions);
    try {
      auto pair = std::make_shared<PingPong>(*system, own, options);
      contenders.push_back({system->name(), system->role(),
                            [pair](double seconds) { return pair->round(seconds); }});
    } catch (const std::exception& error) {
      absent_ones.push_back(absent(system->name(), system->role(), error.what()));
    }
  }
  return contenders;
}

}  // namespace arbiter::bench
