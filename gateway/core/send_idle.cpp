#include "gateway/core/send_idle.hpp"

#include <chrono>
#include <list>
#include <string>
#include <thread>

#include "gateway/core/account.hpp"
#include "gateway/core/outgoing.hpp"
#include "gateway/core/say.hpp"
#include "shm/clock.hpp"

namespace arbiter::gateway {
namespace {

constexpr auto kAgain = std::chrono::milliseconds(25);

struct Part {
  explicit Part(const Entry& of) : entry(of), account(of.outside(), "subscriber") {}

  const Entry& entry;
  Account account;
  Sender* sender = nullptr;
};

}  // namespace

bool send_idle(const std::vector<Mapping>& mappings, Kind kind, Middleware& middleware,
               shm::Nanoseconds time) {
  std::list<Part> parts;
  for (const Mapping& mapping : mappings) {
    for (const Gateway& gateway : mapping.gateways) {
      if (gateway.kind != kind) continue;
      for (const Entry& entry : gateway.entries) {
        if (entry.is_in() || entry.idle.kind == Idle::Kind::kNothing) continue;
        Part& part = parts.emplace_back(entry);
        part.sender = &middleware.sender(gateway, entry, part.account);
      }
    }
  }
  if (parts.empty()) return true;
  middleware.start({}, {});
  const shm::Nanoseconds end = shm::monotonic_now() + time;
  while (shm::monotonic_now() < end) {
    middleware.tend();
    for (Part& part : parts) {
      const std::vector<std::byte>& sample = part.entry.idle.sample;
      if (part.sender->send({sample.data(), sample.size()}) == Sender::Result::kSent) {
        part.account.idle.add();
      }
    }
    std::this_thread::sleep_for(kAgain);
  }
  bool is_sent = true;
  for (const Part& part : parts) {
    const std::uint64_t times = part.account.idle.value();
    say(times == 0 ? Level::kError : Level::kInfo,
        (times == 0 ? "idle sample not sent: "
                    : "idle sample sent " + std::to_string(times) + " times: ") +
            part.account.state());
    is_sent = is_sent && times != 0;
  }
  middleware.stop();
  return is_sent;
}

}  // namespace arbiter::gateway
