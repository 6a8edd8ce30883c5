// Records a running instance: polls its taps, and hands what they tell to a sink.
//
// Three threads. The caller's polls, at a steady period, and never waits for anything else. The
// watcher's asks the daemon and opens taps. The pipeline's puts records into order and writes them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <unordered_set>
#include <vector>

#include "recorder/options.hpp"
#include "recorder/pipeline.hpp"
#include "recorder/record_queue.hpp"
#include "recorder/sink.hpp"
#include "recorder/tap_reader.hpp"
#include "recorder/watcher.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::recorder {

// How many sources there were, by their names: these may come and go for as long as it is recorded.
// Beyond kMost it only knows that there were more.
class CountedSources {
 public:
  static constexpr std::size_t kMost = 65'536;

  void note(const std::string& name) {
    if (hashes_.size() <= kMost) hashes_.insert(std::hash<std::string>()(name));
  }
  [[nodiscard]] std::size_t count() const { return hashes_.size(); }

 private:
  std::unordered_set<std::size_t> hashes_;
};

struct Recorded {
  std::uint64_t arrivals = 0;
  std::size_t sources = 0;  // that something was recorded of, as CountedSources has it
  std::uint64_t winner_changes = 0;
  std::uint64_t lost_events = 0;
  std::uint64_t lost_samples = 0;
  Nanoseconds time = 0;
};

class Recorder {
 public:
  // Joins the instance, and taps its sources. Keeps both. Throws wire::CallError, arbiter::Error.
  Recorder(const RecorderOptions& options, Sink& sink);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder();

  // How many sources are watched.
  [[nodiscard]] std::size_t taps() const { return taps_.size(); }
  // Until `end` on CLOCK_MONOTONIC. Where the descriptor `events` is readable, `goes_on` takes up
  // what there is, and says whether to go on. Ends where the sink has failed, too.
  void run(Nanoseconds end, int events, const std::function<bool()>& goes_on);
  // Writes what waits, and ends. Throws what the sink throws.
  Recorded finish();

 private:
  void poll_taps();
  // Returns those that are to be forgotten once they have been read.
  std::vector<std::shared_ptr<TapReader>> take_new_taps();
  void forget_taps();
  void count(const TapReader& tap);

  const RecorderOptions& options_;
  RecordQueue queue_;
  Watcher watcher_;
  shm::FileDescriptor failed_;  // readable: the pipeline has ended
  Pipeline pipeline_;
  std::vector<std::shared_ptr<TapReader>> taps_;
  Nanoseconds last_poll_ = 0;
  Nanoseconds last_push_ = 0;
  Nanoseconds started_ = 0;
  Recorded recorded_;
  CountedSources heard_;
};

}  // namespace arbiter::recorder
