// An `out` entry: what an input port of Arbiter takes is sent outside, and while the port is idle,
// what the mapping says.
//
// Thread safety: one thread, the gateway's loop; peer_matched() from any.
#pragma once

#include <atomic>
#include <optional>
#include <string_view>

#include <arbiter/input_port.hpp>
#include <arbiter/node.hpp>

#include "gateway/core/account.hpp"
#include "gateway/core/freshness.hpp"
#include "gateway/mapping/mapping.hpp"
#include "shm/activity.hpp"

namespace arbiter::gateway {

// The middleware's half of an `out` entry.
class Sender {
 public:
  enum class Result {
    kSent,
    kNotReady,  // there is nothing to send it to, such as no RouDi; it is passed over
    kNoMemory,
    kTooLarge,
    kRefused,
  };

  Sender() = default;
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;
  virtual ~Sender() = default;

  // Copies the bytes once, and does not wait for long: the loop serves other ports too.
  [[nodiscard]] virtual Result send(Bytes sample) noexcept = 0;
};

// The type with which an entry's ports are opened.
[[nodiscard]] Type type_of(const Entry& entry);

class Outgoing {
 public:
  // While a port is idle: one lost datagram must not leave a robot driving.
  static constexpr shm::Nanoseconds kIdlePeriod = 100'000'000;
  // Samples that run() sends before others have their turn.
  static constexpr std::uint32_t kMostAtOnce = 64;

  // Opens the port. Keeps references. Throws arbiter::Error.
  Outgoing(Node& node, const Entry& entry, Sender& sender, Account& account,
           const AgesOfSources& ages);

  // Readable when run() has something to do.
  [[nodiscard]] int descriptor() { return port_.fd(); }
  // Sends what waits, unless it has waited for longer than its source's T: a gateway that was
  // stopped must not bring old commands to life. And the idle sample where it is due: when the port
  // has become idle, at the start, after peer_matched(), and every kIdlePeriod while it is idle.
  void run(shm::Nanoseconds now);
  // When run() is to be called again even if the descriptor is not readable; shm::kForever: never.
  [[nodiscard]] shm::Nanoseconds next() const noexcept;
  // A reader has come: it is sent the idle sample at the next run(), which the caller brings about.
  void peer_matched() noexcept { matched_.store(true, std::memory_order_relaxed); }

  [[nodiscard]] const Entry& entry() const noexcept { return entry_; }
  // Tells the daemon how things stand.
  void describe(std::string_view text) { port_.describe(text); }

 private:
  void send(Bytes sample) noexcept;

  const Entry& entry_;
  Sender& sender_;
  Account& account_;
  const AgesOfSources& ages_;
  InputPort<void> port_;
  std::atomic<bool> matched_{false};
  bool has_more_ = false;                       // run() has left samples to the next one
  std::optional<shm::Nanoseconds> idle_again_;  // when; empty: the port was not idle
};

}  // namespace arbiter::gateway
