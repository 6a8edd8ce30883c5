// From the queue to where records go: brings them into the order of time, works out who wins, and
// hands both on, some tenths of a second late, for some things are told late. A thread of its own,
// which may wait for a disk.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <queue>
#include <string>
#include <unordered_map>
#include <vector>

#include "evidence/winner_track.hpp"
#include "recorder/record_queue.hpp"
#include "recorder/sink.hpp"

namespace arbiter::recorder {

// What a source tells stays in its order; across sources, and with what is read of pages, records
// are ordered by time, as far as they have come before the horizon.
class TimeOrder {
 public:
  // `now`: what bears a later time, whatever its publisher's clock may be, is not held back for it.
  void add(RecordPtr record, Nanoseconds now);
  // Those before `horizon`, one by one.
  template <class Use>
  void take_before(Nanoseconds horizon, const Use& use) {
    while (!waiting_.empty() && waiting_.top().key < horizon) {
      const RecordPtr record = waiting_.top().record;
      waiting_.pop();
      bytes_ -= evidence::size_of(*record);
      use(record);
    }
    if (last_.size() <= 2 * kept_) return;
    // What comes later, even with a time before, is behind all that has gone.
    std::erase_if(last_, [&](const auto& each) { return each.second < horizon; });
    kept_ = std::max(last_.size(), kFewSources);
  }
  // Of how many sources something is kept.
  [[nodiscard]] std::size_t sources() const { return last_.size(); }
  // Of what waits.
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  struct Waiting {
    Nanoseconds key = 0;
    std::uint64_t number = 0;
    RecordPtr record{};
    friend bool operator<(const Waiting& one, const Waiting& other) {
      return one.key != other.key ? one.key > other.key : one.number > other.number;
    }
  };
  std::priority_queue<Waiting> waiting_;
  static constexpr std::size_t kFewSources = 1024;
  std::unordered_map<std::string, Nanoseconds> last_;  // key of each source that has told lately
  std::size_t kept_ = kFewSources;                     // of them, when it was last looked
  std::uint64_t number_ = 0;
  std::size_t bytes_ = 0;
};

class Pipeline {
 public:
  // Keeps both. `failed` is called, once, on the pipeline's thread.
  Pipeline(RecordQueue& queue, Sink& sink, std::function<void()> failed);
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;
  // Waits until the queue has been closed, and all of it is written: a future of std::async() does.
  ~Pipeline() = default;

  // The same. Throws what has gone wrong.
  void finish() { ended_.get(); }
  // The same, for so long at most. False: it is still writing.
  [[nodiscard]] bool ends_within(std::chrono::milliseconds patience) const {
    return ended_.wait_for(patience) == std::future_status::ready;
  }
  // After finish(): of the input ports' winners; what the records say is missing.
  [[nodiscard]] std::uint64_t winner_changes() const { return winner_changes_; }
  [[nodiscard]] std::uint64_t lost_events() const { return lost_events_; }
  [[nodiscard]] std::uint64_t lost_samples() const { return lost_samples_; }

 private:
  void run();
  void work();
  void take(Batch&& batch);
  void pass_on_before(Nanoseconds known, Nanoseconds horizon);
  void pass_on(const RecordPtr& record);
  void advance(Nanoseconds time);
  void write_changes();
  void follow(const Record& record);

  RecordQueue& queue_;
  Sink& sink_;
  const std::function<void()> failed_;
  TimeOrder order_;
  Nanoseconds newest_ = 0;   // what happened before has come
  Nanoseconds next_ = 0;     // this, when it was noted
  Nanoseconds noted_ = 0;    // then
  Nanoseconds horizon_ = 0;  // what happened before has been passed on
  evidence::WinnerTrack winners_;
  std::vector<RecordPtr> changes_;  // of winners, by the record that is being followed
  std::uint64_t winner_changes_ = 0;
  std::uint64_t lost_events_ = 0;
  std::uint64_t lost_samples_ = 0;
  std::future<void> ended_;  // last: the thread uses all of these
};

}  // namespace arbiter::recorder
