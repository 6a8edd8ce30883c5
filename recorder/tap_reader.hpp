// One source, read through a tap: its events as records.
//
// Where the queue to the writer is nearly full, payloads are left out; where it is full, events
// are. Either is counted and told as soon as there is room; behind events that are missing comes a
// state, so that who reads the recording knows where he stands. A payload that no reader of the
// file would be ready for is left out, too.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <arbiter/tap.hpp>

#include "recorder/record_queue.hpp"
#include "recording/mcap.hpp"
#include "shm/clock.hpp"

namespace arbiter::recorder {

// What a record of missing events says where these are at least one.
inline constexpr const char* kUnknownNumber = "how many there were is not known";

// What there is room for.
enum class Room : std::uint8_t { all, no_payloads, none };

// What waits for the writer, with what has been read in this round, and how much may.
struct Backlog {
  Waiting waiting;
  std::size_t most = 0;

  // Payloads, however large, leave a quarter for records.
  [[nodiscard]] Room room() const {
    const std::size_t share = most / 4 * 3;
    if (waiting.records + std::min(waiting.payloads, share) > most) return Room::none;
    return waiting.all() > share ? Room::no_payloads : Room::all;
  }
  // One that is larger than all that may wait has room where little waits.
  [[nodiscard]] bool has_room_for(std::size_t payload) const {
    return room() == Room::all && (waiting.all() <= most / 4 || payload <= most - waiting.all());
  }
};

// What was left out since the last record.
struct LeftOut {
  std::uint64_t events = 0;
  Nanoseconds from = 0;
  Nanoseconds to = 0;
  evidence::SourceState last{};
};

class TapReader {
 public:
  // `before`: what its page said. `most_payload`: what readers are ready for.
  TapReader(Tap<> tap, bool with_payloads, evidence::ActivityWord before,
            std::size_t most_payload = recording::kMaxMessageBytes)
      : tap_(std::move(tap)),
        with_payloads_(with_payloads),
        most_payload_(most_payload),
        opened_(shm::monotonic_now()),
        told_(before) {}

  // The thread that polls.

  // Appends what has happened since; returns true if ports have been opened or closed.
  bool poll(Backlog& backlog, std::vector<RecordPtr>& records);
  [[nodiscard]] std::uint64_t arrivals() const { return arrivals_; }
  // Nothing more will be read: says what was left out last.
  void finish(std::vector<RecordPtr>& records);

  // Any thread. Hints for who looks at the page of a source that nobody tells of; one writer, the
  // thread that polls. Relaxed is enough, for neither stands for other memory: both parts of
  // polled() are of one poll, because they are one word, and after a told() that is older than
  // that, the page only says once more what the tap has told.

  struct Polled {
    std::uint64_t polls;  // that have ended
    bool is_live;         // a port is open, as the last of them found
  };
  [[nodiscard]] Polled polled() const {
    const std::uint64_t word = polled_.load(std::memory_order_relaxed);
    return {word / 2, word % 2 != 0};
  }
  [[nodiscard]] evidence::ActivityWord told() const {
    return told_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] const std::string& name() const { return tap_.name(); }

 private:
  void take(const TapEvent<>& event, const Backlog& backlog, std::vector<RecordPtr>& records);
  void add_state(const TapEvent<>& event, Nanoseconds seen, std::vector<RecordPtr>& records);
  void add_arrival(const TapEvent<>& event, Nanoseconds seen, const Backlog& backlog,
                   std::vector<RecordPtr>& records);
  [[nodiscard]] std::optional<evidence::Missed::Why> take_payload(const TapEvent<>& event,
                                                                  const Backlog& backlog,
                                                                  evidence::Arrival& arrival) const;
  void leave_out(const TapEvent<>& event, Nanoseconds seen);
  void tell_left_out(std::vector<RecordPtr>& records);
  const evidence::ContextPtr& context_of(const TapEvent<>& event);

  Tap<> tap_;
  const bool with_payloads_;
  const std::size_t most_payload_;
  evidence::ContextPtr context_;
  std::optional<LeftOut> left_out_;
  std::uint64_t arrivals_ = 0;
  const Nanoseconds opened_;  // what was before is not to be told
  Nanoseconds last_ = 0;      // of what has happened, as far as has been told; 0: nothing has been
  std::atomic<std::uint64_t> polled_{0};  // twice the number of polls, and 1 if a port is open
  std::atomic<evidence::ActivityWord> told_;
};

}  // namespace arbiter::recorder
