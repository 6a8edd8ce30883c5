// A gateway's stay with one RouDi: its publishers and subscribers, and the thread that makes them
// and then takes what comes.
//
// The calls that talk to RouDi may block for as long as RouDi is stopped, and iceoryx ends the
// process where RouDi does not answer for a minute. So they are made by this thread; the bridge's
// loop goes on, and says how things stand.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <iceoryx_posh/popo/untyped_publisher.hpp>
#include <iceoryx_posh/popo/untyped_subscriber.hpp>
#include <iceoryx_posh/popo/wait_set.hpp>
#include <iceoryx_posh/runtime/service_discovery.hpp>

#include "gateway/core/middleware.hpp"
#include "gateway/iceoryx/roudi.hpp"

namespace arbiter::gateway {

// The half of an `out` entry that talks to iceoryx. One thread at a time. It never waits: a
// subscriber that is full loses its oldest chunk.
class ChunkSender final : public Sender {
 public:
  ChunkSender(const Entry& entry, Account& account) : entry_(entry), account_(account) {}

  [[nodiscard]] Result send(Bytes sample) noexcept override;
  // From the session's thread, once; the loop sees it from then on.
  void use(iox::popo::UntypedPublisher& publisher) noexcept {
    // Release; pairs with the acquire in publisher(): who sees the publisher finds it made.
    publisher_.store(&publisher, std::memory_order_release);
  }
  [[nodiscard]] iox::popo::UntypedPublisher* publisher() const noexcept {
    return publisher_.load(std::memory_order_acquire);
  }
  [[nodiscard]] const Entry& entry() const noexcept { return entry_; }
  [[nodiscard]] Account& account() const noexcept { return account_; }

 private:
  const Entry& entry_;
  Account& account_;
  std::atomic<iox::popo::UntypedPublisher*> publisher_{nullptr};
};

class Session {
 public:
  // `name`: of the runtime, no other process's. Keeps references. Starts the thread.
  Session(std::string name, RoudiIdentity roudi, std::vector<Middleware::OpenIn> ins,
          std::vector<ChunkSender*> outs);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  // Waits for the thread, if it comes to an end within a second; else leaves it behind.
  ~Session();

  [[nodiscard]] const RoudiIdentity& roudi() const noexcept { return roudi_; }
  // All publishers and subscribers are made.
  [[nodiscard]] bool is_ready() const noexcept { return ready_.load(std::memory_order_acquire); }
  // When its thread last went round, by CLOCK_MONOTONIC.
  [[nodiscard]] shm::Nanoseconds last_round() const noexcept {
    return last_round_.load(std::memory_order_relaxed);
  }
  // The thread was held up for so long that RouDi has given its process up.
  [[nodiscard]] bool has_stalled() const noexcept {
    return stalled_.load(std::memory_order_relaxed);
  }

 private:
  struct Inlet;

  void run();
  void make_ends();
  void take_all(Inlet& inlet);
  void take_for_ever();
  void look_for_publishers(shm::Nanoseconds now);

  const std::string name_;
  const RoudiIdentity roudi_;
  const std::vector<Middleware::OpenIn> ins_;
  const std::vector<ChunkSender*> outs_;
  std::vector<std::unique_ptr<iox::popo::UntypedPublisher>> publishers_;
  std::vector<std::unique_ptr<Inlet>> inlets_;
  std::unique_ptr<iox::popo::WaitSet<>> wait_set_;
  std::unique_ptr<iox::runtime::ServiceDiscovery> discovery_;  // it is large
  shm::Nanoseconds looked_for_publishers_ = 0;
  std::atomic<bool> ready_{false};
  std::atomic<bool> ends_{false};
  std::atomic<bool> ended_{false};
  std::atomic<bool> stalled_{false};
  std::atomic<shm::Nanoseconds> last_round_{0};
  std::thread thread_;
};

}  // namespace arbiter::gateway
