// An `out` entry: what an input port of Arbiter takes is sent outside, and while the port is idle,
// what the mapping says.
//
// A sample of the same gateway's goes straight on: the thread that delivers it takes a turn here,
// and sends what becomes of it, so that neither the loop nor another thread has to be woken
// (Incoming::deliver()). The loop serves what comes from other components, what is too large for
// that, and what is left.
//
// Thread safety: one thread, the gateway's loop; begin_turn() and end_turn() from the threads that
// deliver samples; peer_matched() from any. Whoever has the turn has the port.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include <arbiter/input_port.hpp>
#include <arbiter/node.hpp>
#include <arbiter/output_port.hpp>

#include "gateway/core/account.hpp"
#include "gateway/core/feed.hpp"
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
    kUnreadable,  // it cannot be a sample of the topic's type
    kRefused,
    kBusy,  // of send_at_once() and send_draft(): it would have to wait
  };

  Sender() = default;
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;
  virtual ~Sender() = default;

  // Copies the bytes once, and does not wait for long: the loop serves other ports too.
  [[nodiscard]] virtual Result send(Bytes sample) noexcept = 0;
  // As send(), but called where the middleware delivers a sample, on whatever thread it does so. It
  // must not wait there: that thread may be the one that it would wait for.
  [[nodiscard]] virtual Result send_at_once(Bytes sample) noexcept { return send(sample); }
  // Samples of more bytes are none for send_at_once(), because to send them takes so long that what
  // that thread delivers next would be held up.
  [[nodiscard]] virtual std::size_t largest_at_once() const noexcept { return SIZE_MAX; }

  // Memory of the middleware's for a sample of that many bytes: who does not know yet whether it is
  // to be sent writes it there, and a large sample is copied once. Empty: not to be had, or not
  // worth it. There is one draft at a time, until send_draft() or drop_draft().
  [[nodiscard]] virtual WritableBytes draft(std::size_t /*bytes*/) noexcept { return {}; }
  // As send_at_once(). With kBusy the draft is still there, and can still be read.
  [[nodiscard]] virtual Result send_draft() noexcept { return Result::kNotReady; }
  virtual void drop_draft() noexcept {}
};

// The `in` entries of a gateway by their sources, of which an entry may have two.
using FeedBySource = std::map<std::string, Feed*, std::less<>>;

// The type with which an entry's ports are opened.
[[nodiscard]] Type type_of(const Entry& entry);

class Outgoing {
 public:
  // While a port is idle: one lost datagram must not leave a robot driving.
  static constexpr shm::Nanoseconds kIdlePeriod = 100'000'000;
  // Samples that run() sends before others have their turn.
  static constexpr std::uint32_t kMostAtOnce = 64;
  // To copy fewer bytes again costs less than to take care of a draft.
  static constexpr std::size_t kSmallestDraft = 4096;

  // Opens the port. Keeps references. Throws arbiter::Error.
  Outgoing(Node& node, const Entry& entry, Sender& sender, Account& account,
           const AgesOfSources& ages);
  Outgoing(const Outgoing&) = delete;
  Outgoing& operator=(const Outgoing&) = delete;
  ~Outgoing();

  // Readable when run() has something to do.
  [[nodiscard]] int descriptor() { return port_.fd(); }
  // Sends what waits, unless it has waited for longer than its source's T: a gateway that was
  // stopped must not bring old commands to life. And the idle sample where it is due: when the port
  // has become idle, at the start, after peer_matched(), and every kIdlePeriod while it is idle. A
  // port whose winner's last sample could not be sent, or was too old, counts as idle until one is
  // sent.
  // A sample's age is that at which it is sent, and not at `now`: others may have waited meanwhile.
  void run(shm::Nanoseconds now);
  // Before run(): whose samples may go straight on, and what lets the loop run() all. The loop.
  void lead(const FeedBySource& feeds, std::function<void()> call_loop);
  // Before a sample of that many bytes is published. False: somebody else has the turn, or
  // something is left for the loop, or the sample itself is; publish all the same. Never waits. Any
  // thread.
  [[nodiscard]] bool begin_turn(std::size_t bytes) noexcept;
  // In a turn: where the sample that is about to be published is to be written, instead of to its
  // loan, so that the end of the turn need not copy it. Empty: nowhere.
  [[nodiscard]] WritableBytes draft(std::size_t bytes) noexcept;
  // Publishes what has been written there. True: it is late. Throws for another port's loan.
  bool publish_draft(OutputPort<void>& port, Loan<void> loan, Time deadline);
  // Sends what of `source` waits and ends the turn; calls the loop for what is left, and for the
  // idle sample if the port has become idle meanwhile. False: nothing of it has come here.
  bool end_turn(std::string_view source, shm::Nanoseconds max_age) noexcept;
  // The gateway ends: sends the idle sample, whoever commands, and nothing of the port's from then
  // on, because whoever obeys would go on with the last command for ever. May be called again, lest
  // the one sample be lost. Nothing where there is no idle sample. The loop.
  void end() noexcept;
  // When run() is to be called again even if the descriptor is not readable; shm::kForever: never.
  [[nodiscard]] shm::Nanoseconds next() const noexcept {
    // Relaxed is enough: who leaves something to the loop calls it afterwards.
    return next_.load(std::memory_order_relaxed);
  }
  // A reader has come: it is sent the idle sample at the next run(), which the caller brings about.
  void peer_matched() noexcept { matched_.store(true, std::memory_order_relaxed); }

  [[nodiscard]] const Entry& entry() const noexcept { return entry_; }
  // Tells the daemon how things stand.
  void describe(std::string_view text, bool is_trouble) {
    is_trouble ? port_.describe_trouble(text) : port_.describe(text);
  }

 private:
  void send_waiting(shm::Nanoseconds now);
  void send_idle(shm::Nanoseconds now);
  // The entry from which samples of that source come; null: they come from a component.
  [[nodiscard]] Feed* feed_of(std::string_view source) const noexcept;
  // False: what comes from that entry has another header, and is counted.
  [[nodiscard]] bool has_right_header(const Feed& in, std::size_t size);
  [[nodiscard]] Sender::Result send_in_turn(const Sample<void>& sample,
                                            shm::Nanoseconds stamp) noexcept;
  void send_idle_sample() noexcept;
  [[nodiscard]] bool is_drafted(const Sample<void>& sample, shm::Nanoseconds stamp) const noexcept;
  // Of one that the loop is about to send.
  [[nodiscard]] Bytes bytes_of(const Sample<void>& sample) const noexcept;
  void write_draft() noexcept;
  void drop_draft() noexcept;
  void note_late() noexcept;
  void account_for(Sender::Result result, std::size_t size) noexcept;
  [[nodiscard]] shm::Nanoseconds when_next() const noexcept;

  const Entry& entry_;
  Sender& sender_;
  Account& account_;
  const AgesOfSources& ages_;
  std::mutex turn_;  // of the port, the sender, and all below but for the atomics
  std::atomic<bool> loop_waits_{false};  // for the turn; a hint, which nothing depends on
  InputPort<void> port_;
  const FeedBySource* feeds_ = nullptr;
  const Feed* told_ = nullptr;  // whose samples have another header, last
  std::function<void()> call_loop_;
  std::optional<Sample<void>> left_;  // taken by a thread that could not send it
  // Of the turn, until it is sent or dropped; or of left_, which the writer had no room for.
  struct Draft {
    WritableBytes bytes;
    shm::Nanoseconds since;      // before its sample was published
    std::uint64_t sequence = 0;  // of that sample; 0: it has not come here
    // Its bytes in Arbiter's memory, where somebody may find them who needs them there; empty: they
    // have been written, or nobody will.
    WritableBytes unwritten{};
  };
  std::optional<Draft> draft_;
  std::atomic<bool> matched_{false};
  std::atomic<shm::Nanoseconds> next_{shm::kForever};  // when_next()
  bool has_more_ = false;                              // something is left to run(), such as left_
  bool has_ended_ = false;
  // The winner's last sample could not be sent, or not in time. Whoever obeys would go on with the
  // one before, as if nobody commanded: so until one is sent it is told what an idle port is.
  bool is_unheard_ = false;
  std::optional<shm::Nanoseconds> idle_again_;  // when; empty: the port was not idle
};

}  // namespace arbiter::gateway
