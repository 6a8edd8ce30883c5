#include "gateway/core/send_idle.hpp"

#include <algorithm>
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
// For a domain to be joined, which may wait for a name server.
constexpr shm::Nanoseconds kMostPatience = 30'000'000'000;

struct Part {
  explicit Part(const Entry& of) : entry(of), account(of.outside(), "subscriber") {}

  const Entry& entry;
  Account account;
  Sender* sender = nullptr;
  bool is_heard = false;  // sent while somebody may have been matched
};

// False: it could never be sent.
bool tell(const Part& part) {
  const std::uint64_t times = part.account.idle.value();
  say(times == 0 ? Level::kError : Level::kInfo,
      (times == 0 ? "idle sample not sent: "
                  : "idle sample sent " + std::to_string(times) + " times: ") +
          part.account.state());
  return times != 0;
}

void send(Part& part) {
  const std::vector<std::byte>& sample = part.entry.idle.sample;
  if (part.sender->send({sample.data(), sample.size()}) != Sender::Result::kSent) return;
  part.account.idle.add();
  part.is_heard = part.is_heard || part.account.may_have_peers();
}

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
  const shm::Nanoseconds begun = shm::monotonic_now();
  shm::Nanoseconds end = begun + time;
  do {
    middleware.tend();
    for (Part& part : parts) send(part);
    std::this_thread::sleep_for(kAgain);
    if (middleware.is_joining()) {
      end = std::min(shm::monotonic_now(), begun + kMostPatience) + time;
    }
  } while (shm::monotonic_now() < end);
  bool is_sent = true;
  for (const Part& part : parts) is_sent = tell(part) && is_sent;
  // Behind all others: in a journal of many lines this is what somebody has to know.
  for (const Part& part : parts) {
    if (part.is_heard || part.account.idle.value() == 0) continue;
    say(Level::kWarning, "nobody was there to hear it: no subscriber of " + part.entry.outside());
  }
  middleware.stop();
  return is_sent;
}

}  // namespace arbiter::gateway
