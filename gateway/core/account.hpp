// What became of the samples of one entry, and how things stand with the topic outside: for
// `arbiter status`, `arbiter why`, and whoever asks a gateway itself.
//
// Thread safety: counters have one writer each (the thread that delivers or sends), any thread
// reads them. The other calls may come from any thread, and take a lock that is held for a few
// copies; so a middleware's thread calls them when something has changed, not for each sample.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>

namespace arbiter::gateway {

inline constexpr std::size_t kMaxDescription = 480;  // bytes of Account::text()

// A count of samples with one writer.
class Count {
 public:
  // Relaxed is enough: a count orders nothing, and whoever reads it takes it for what it was.
  void add() noexcept {
    count_.store(count_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t value() const noexcept {
    return count_.load(std::memory_order_relaxed);
  }

 private:
  std::atomic<std::uint64_t> count_{0};
};

class Account {
 public:
  // `outside`: Entry::outside(). `other`: what stands at the other end, "publisher" or
  // "subscriber".
  Account(std::string outside, std::string other);

  Count passed;
  Count late;        // too old when the gateway could pass it on
  Count too_large;   // for max_size, or of another size than the type's
  Count unreadable;  // it could not be read, its field is none, or it cannot be of its type
  Count no_slot;     // no memory for it, here or outside
  Count refused;     // by the middleware, when it was sent
  Count overflows;   // of the middleware's queue: each time one sample at least was lost
  Count idle;        // idle samples sent

  // Twice a second, with CLOCK_MONOTONIC: how many samples pass in a second, and since when none
  // has, in steps, so that text() changes seldom. The gateway's loop.
  void look(std::int64_t now) noexcept;

  // Of the last sample that passed, in bytes. The thread that delivers or sends.
  void set_last_size(std::size_t size) noexcept {
    last_size_.store(size, std::memory_order_relaxed);
  }

  // How many at the other end are matched. Nothing is said of them where nobody has called this.
  // `at_least`: there may be more.
  void set_peers(std::uint32_t peers, bool at_least = false) noexcept;
  // Where they are looked for, said behind "no publisher matched", such as " in domain 91".
  void set_place(std::string place);
  // Whether somebody at the other end is matched, or may be: nobody knows.
  [[nodiscard]] bool may_have_peers() const noexcept;
  // What keeps the topic from working as a whole, such as "RouDi does not run"; empty: nothing.
  // `is_trouble`: somebody should mend it.
  void set_obstacle(std::string_view text, bool is_trouble = true);
  [[nodiscard]] bool is_trouble() const;
  // Why a sample was passed over, or an end refused, last: "QoS: the publisher is best effort, this
  // entry asks for reliable (reliability=\"best_effort\")". Kept, with the counts, until the next.
  void set_last_reason(std::string_view text);

  // "DDS topic rt/cmd_vel_nav, 1 publisher matched, 20 samples a second, the last one has 52 bytes;
  // 3 late". Control characters are escaped; at most kMaxDescription bytes.
  [[nodiscard]] std::string text() const;
  // The same without counts: what is worth a line in the log when it changes.
  [[nodiscard]] std::string state() const;
  [[nodiscard]] const std::string& outside() const noexcept { return outside_; }

 private:
  // Under mutex_.
  [[nodiscard]] std::string state_of_topic() const;
  [[nodiscard]] std::string traffic() const;

  // What samples are counted in.
  struct Window {
    std::int64_t since = 0;
    std::uint64_t passed = 0;  // before
    [[nodiscard]] double rate(std::int64_t now, std::uint64_t count) const noexcept;
  };
  void measure(std::int64_t now, std::uint64_t count) noexcept;

  std::atomic<std::size_t> last_size_{0};  // here, beside the counts: each sample writes both
  const std::string outside_;
  const std::string other_;
  mutable std::mutex mutex_;
  std::string place_;
  std::string obstacle_;
  bool is_trouble_ = false;
  std::string last_reason_;
  std::int64_t peers_ = -1;  // not known
  bool at_least_ = false;
  // As look() has found.
  std::int64_t looked_at_ = 0;
  std::int64_t passed_at_ = 0;  // the last look at which another sample had passed
  std::uint64_t passed_before_ = 0;
  bool is_silent_ = true;
  Window recent_, steady_;  // steady_: since rate_ has been about the same
  double rate_ = 0;         // of samples in a second; 0: not known
};

}  // namespace arbiter::gateway
