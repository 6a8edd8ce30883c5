// An `in` entry: samples from outside become arrivals at output ports of Arbiter.
//
// Thread safety: deliver() and fail() from one thread at a time, which may be a middleware's. After
// the constructor neither allocates, nor waits, nor throws.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <arbiter/node.hpp>
#include <arbiter/output_port.hpp>

#include "gateway/core/account.hpp"
#include "gateway/core/feed.hpp"
#include "gateway/core/freshness.hpp"
#include "gateway/mapping/mapping.hpp"

namespace arbiter::gateway {

// A sample as the middleware has it. The bytes are those that Arbiter's components get: for DDS
// the serialised sample with its encapsulation header, for iceoryx user header and payload.
class ForeignSample {
 public:
  ForeignSample() = default;
  ForeignSample(const ForeignSample&) = delete;
  ForeignSample& operator=(const ForeignSample&) = delete;
  virtual ~ForeignSample() = default;

  [[nodiscard]] virtual std::size_t size() const noexcept = 0;
  // Copies the bytes from `from` on, to.size() of them, which lie within size(). False: it cannot
  // be read.
  [[nodiscard]] virtual bool copy(std::size_t from, WritableBytes to) const noexcept = 0;
  // Where its data begin: behind headers. Offsets of fields count from there.
  [[nodiscard]] virtual std::size_t data_begin() const noexcept { return 0; }
  [[nodiscard]] virtual bool is_big_endian() const noexcept { return false; }
};

class Outgoing;

// Why a sample of so many bytes does not fit: "the last bad sample has 5012 bytes; max_size is
// 1024".
[[nodiscard]] std::string does_not_fit(const Entry& entry, std::size_t bytes);

// Which source a sample's field chooses; empty: it has none, or it is NaN, or no Boolean.
enum class Side { kYes, kNo };
[[nodiscard]] std::optional<Side> choose(const Choice& choice,
                                         const ForeignSample& sample) noexcept;

class Incoming {
 public:
  // What became of a sample.
  enum class Fate { kPassed, kLate, kTooLarge, kUnreadable, kNoSlot };

  // Opens the entry's port, or ports. Keeps references. Throws arbiter::Error. `first`: the
  // number of the port to begin with; left at the one that is refused, so that who tries again
  // does not open the other in vain.
  Incoming(Node& node, const Entry& entry, Account& account, std::size_t* first = nullptr);

  // One copy into Arbiter's memory, or to where it is sent from, and an arrival, unless `deadline`
  // has passed by then: that of max_age().get(). With a choice: an arrival at the source that the
  // field chooses, if the entry has it, whose own age counts, and then the end of the other's
  // activity; where nothing can be chosen, or the size is not the type's, of both. publish() throws
  // for another port's loan, and this one is its own.
  Fate deliver(const ForeignSample& sample,  // NOLINT(bugprone-exception-escape)
               Time deadline) noexcept;
  // A sample came that cannot be read at all. With a choice its sources end.
  void fail() noexcept;

  // How old a sample may be when it arrives. Written by MaxAges.
  [[nodiscard]] MaxAge& max_age() noexcept { return max_age_; }
  [[nodiscard]] const MaxAge& max_age() const noexcept { return max_age_; }

  [[nodiscard]] const Entry& entry() const noexcept { return feed_.entry(); }
  [[nodiscard]] Feed& feed() noexcept { return feed_; }
  // Tells the daemon how things stand. The gateway's loop.
  void describe(std::string_view text, bool is_trouble);

 private:
  [[nodiscard]] std::optional<OutputPort<void>>& port_of(const Port& port) noexcept;
  Fate pass_on(const ForeignSample& sample,  // NOLINT(bugprone-exception-escape): as deliver()
               Time deadline) noexcept;
  // `outgoing`: null, or where this thread has the turn.
  Fate pass_to(OutputPort<void>& port,  // NOLINT(bugprone-exception-escape): as deliver()
               const ForeignSample& sample, Time deadline, Outgoing* outgoing = nullptr) noexcept;
  void deactivate_all() noexcept;

  Feed feed_;
  Account& account_;
  MaxAge max_age_;
  // Without a choice the first; with one, what it has of the two.
  std::optional<OutputPort<void>> yes_;
  std::optional<OutputPort<void>> no_;
};

}  // namespace arbiter::gateway
