// A gateway's stay with one RouDi: its publishers and subscribers, and the thread that makes them
// and then takes what comes.
//
// The calls that talk to RouDi may block for as long as RouDi is stopped, and iceoryx ends the
// process where RouDi does not answer for a minute. So they are made by this thread; the bridge's
// loop goes on, and says how things stand.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <iceoryx_posh/popo/wait_set.hpp>

#include "gateway/core/announced.hpp"
#include "gateway/core/middleware.hpp"
#include "gateway/core/pauses.hpp"
#include "gateway/iceoryx/inlet.hpp"
#include "gateway/iceoryx/port_list.hpp"
#include "gateway/iceoryx/publisher.hpp"
#include "gateway/iceoryx/roudi.hpp"

namespace arbiter::gateway {

// The half of an `out` entry that talks to iceoryx. One thread at a time. It never waits: a
// subscriber that is full loses its oldest chunk. To send is to copy, whatever the size, so that
// chunks of any size are sent at once.
class ChunkSender final : public Sender {
 public:
  ChunkSender(const Entry& entry, Account& account) : entry_(entry), account_(account) {}

  [[nodiscard]] Result send(Bytes sample) noexcept override;
  // A chunk. Where the topic has user headers, a sample does not lie in a chunk in one piece.
  [[nodiscard]] WritableBytes draft(std::size_t bytes) noexcept override;
  [[nodiscard]] Result send_draft() noexcept override;
  void drop_draft() noexcept override;
  // From the session's thread, once; the loop sees it from then on.
  void use(Publisher& publisher) noexcept { publisher_.announce(publisher); }
  // Its port is open here: else who serves it says what else is at the topic. The loop.
  void serve() noexcept { is_served_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool is_served() const noexcept {
    return is_served_.load(std::memory_order_relaxed);
  }
  // What is wrong with the publisher, or with who else is at the topic; empty: nothing. From the
  // session's thread. What the account says is for the loop to write, which knows what is wrong
  // with RouDi.
  void set_fault(std::string text) {
    const std::lock_guard lock(mutex_);
    fault_ = std::move(text);
  }
  [[nodiscard]] std::string fault() const {
    const std::lock_guard lock(mutex_);
    return fault_;
  }
  // Null: there is none yet, or RouDi refuses it.
  [[nodiscard]] Publisher* publisher() const noexcept { return publisher_.get(); }
  [[nodiscard]] const Entry& entry() const noexcept { return entry_; }
  [[nodiscard]] Account& account() const noexcept { return account_; }

 private:
  const Entry& entry_;
  Account& account_;
  Announced<Publisher> publisher_;
  std::atomic<bool> is_served_{false};  // relaxed is enough: a flag by itself
  mutable std::mutex mutex_;            // of the next one
  std::string fault_;
  void* draft_ = nullptr;  // of whoever has the entry's turn
};

// What this process's thread of iceoryx is making, for what is said where that ends the process;
// empty: nothing.
[[nodiscard]] std::string what_is_made();

class Session {
 public:
  // `gateway`: what the name of its runtime begins with. Keeps references. Starts the thread.
  Session(std::string gateway, RoudiIdentity roudi, std::vector<Middleware::OpenIn> ins,
          const std::vector<ChunkSender*>& outs);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  // Waits for the thread, if it comes to an end within a second; else leaves it behind.
  ~Session();

  // Entries whose ports could be opened only now. Keeps references. The loop.
  void add(const std::vector<Middleware::OpenIn>& ins);

  [[nodiscard]] const RoudiIdentity& roudi() const noexcept { return roudi_; }
  // All publishers and subscribers are made, but for publishers that RouDi refuses: these are tried
  // again.
  [[nodiscard]] bool is_ready() const noexcept { return waits_.get() != nullptr; }
  // When its thread last went round, by CLOCK_MONOTONIC.
  [[nodiscard]] shm::Nanoseconds last_round() const noexcept {
    return last_round_.load(std::memory_order_relaxed);
  }
  // When RouDi has said something last. Once it is ready.
  [[nodiscard]] shm::Nanoseconds heard_roudi() const noexcept {
    return heard_roudi_.load(std::memory_order_relaxed);
  }
  // The thread was held up for so long that RouDi has given its process up.
  [[nodiscard]] bool has_stalled() const noexcept {
    return stalled_.load(std::memory_order_relaxed);
  }

 private:
  // An `out` entry, who else writes to its topic, and who subscribes to it in vain.
  struct Outlet {
    ChunkSender* sender;
    std::string strangers{};
    News news{};                // of those, in the log
    std::string refused{};      // the first of those, or empty
    std::string not_made{};     // why there is no publisher, or empty
    int looks_without_any = 0;  // at the list, while it has subscribers and the publisher none
  };

  void run();
  void make_ends();
  void make_publisher(Outlet& out);
  void make_refused(shm::Nanoseconds now);
  void make_inlet(const Middleware::OpenIn& in);
  void make_added();
  void take_for_ever();
  void look_at_list(shm::Nanoseconds now);
  void look_for_strangers(Outlet& out, shm::Nanoseconds now) const;
  void look_for_refused(Outlet& out) const;
  static void tell_fault(const Outlet& out);

  const std::string gateway_;
  const RoudiIdentity roudi_;
  const std::vector<Middleware::OpenIn> ins_;  // at the beginning
  std::mutex adding_;                          // of the next one
  std::vector<Middleware::OpenIn> added_;      // not made yet
  // Whether there may be any: a round for each sample need not take the lock. Relaxed is enough:
  // what is missed is found in the next round, and the lock orders what it guards.
  std::atomic<bool> has_added_{false};
  std::vector<Outlet> outs_;
  std::vector<std::unique_ptr<Publisher>> publishers_;
  std::vector<std::unique_ptr<Inlet>> inlets_;
  std::unique_ptr<iox::popo::WaitSet<>> wait_set_;
  bool watches_all_ = true;  // no more topics than a WaitSet can watch
  std::optional<PortList> port_list_;
  shm::Nanoseconds looked_at_list_ = 0;
  shm::Nanoseconds make_again_ = 0;        // publishers that RouDi has refused
  Announced<iox::popo::WaitSet<>> waits_;  // the last that is made
  // Relaxed is enough for these: a flag or a reading by itself, of which the last one counts. Who
  // finds that the thread has ended joins it.
  std::atomic<bool> ends_{false};
  std::atomic<bool> ended_{false};
  std::atomic<bool> stalled_{false};
  std::atomic<shm::Nanoseconds> heard_roudi_{0};
  std::atomic<shm::Nanoseconds> last_round_{0};
  std::thread thread_;
};

}  // namespace arbiter::gateway
