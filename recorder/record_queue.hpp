// Records on their way from those who watch to the one thread that writes.
//
// Bounded by bytes: disks stall, and nobody who watches may wait for one. What does not fit, those
// who watch leave out, count, and say (tap_reader.hpp).
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "evidence/records.hpp"

namespace arbiter::recorder {

using evidence::Nanoseconds;
using evidence::Record;
using evidence::RecordPtr;

struct Batch {
  std::vector<RecordPtr> records;
  // What happened before this time has come, but for publishers that were stopped. 0: nothing is
  // said.
  Nanoseconds horizon = 0;
  // Watching begins here: these come before all that follows, in this order.
  bool is_start = false;

  template <class T>
  void add(T record) {
    records.push_back(std::make_shared<const Record>(std::move(record)));
  }
};

// Bytes.
struct Waiting {
  std::size_t records = 0;  // but for their payloads
  std::size_t payloads = 0;

  void add(const Record& record) {
    const std::size_t payload = evidence::payload_size_of(record);
    records += evidence::size_of(record) - payload;
    payloads += payload;
  }
  [[nodiscard]] std::size_t all() const { return records + payloads; }
};

class RecordQueue {
 public:
  void push(Batch&& batch) {
    Waiting size;
    for (const RecordPtr& record : batch.records) size.add(*record);
    const std::lock_guard lock(mutex_);
    waiting_.records += size.records;
    waiting_.payloads += size.payloads;
    batches_.emplace_back(std::move(batch), size);
    filled_.notify_one();
  }
  [[nodiscard]] Waiting waiting() {
    const std::lock_guard lock(mutex_);
    return waiting_;
  }
  // Waits for a batch; nothing: none has come in that time, or none will.
  std::optional<Batch> pop(std::chrono::milliseconds patience) {
    std::unique_lock lock(mutex_);
    filled_.wait_for(lock, patience, [this] { return !batches_.empty() || is_closed_; });
    if (batches_.empty()) return std::nullopt;
    auto [batch, size] = std::move(batches_.front());
    batches_.pop_front();
    waiting_.records -= size.records;
    waiting_.payloads -= size.payloads;
    return std::move(batch);
  }
  // Nothing more comes.
  void close() {
    const std::lock_guard lock(mutex_);
    is_closed_ = true;
    filled_.notify_one();
  }
  [[nodiscard]] bool is_over() {
    const std::lock_guard lock(mutex_);
    return is_closed_ && batches_.empty();
  }

 private:
  std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<std::pair<Batch, Waiting>> batches_;
  Waiting waiting_;
  bool is_closed_ = false;
};

}  // namespace arbiter::recorder
