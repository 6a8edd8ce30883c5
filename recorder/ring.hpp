// A flight recorder's memory: the last minutes, written out when somebody asks.
//
// Bounded by time and by bytes, whichever comes first. What leaves it has been summed up: the state
// of each source, the model, the open ports and the winners at the moment where the rest begins. So
// each file is whole: it begins as any recording does.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "recorder/sink.hpp"

namespace arbiter::recorder {

struct RingOptions {
  Nanoseconds span = 0;
  std::size_t memory = std::size_t{64} << 20;
  std::string prefix;  // files are called PREFIX-YYYYmmddTHHMMSSZ-WHY.mcap
  recording::McapOptions file;
  evidence::RecordingInfo info;
  // Dump where a component has died.
  bool on_death = true;
  // What has been written, or why it has not; on the pipeline's thread.
  std::function<void(const std::string& file, const std::string& error)> told;
};

class Ring : public Sink {
 public:
  explicit Ring(RingOptions options) : options_(std::move(options)) {}

  // Any thread: write a file as soon as all that has happened by now is here, some twentieths of a
  // second at most. `why` is a word for its name.
  void request(const std::string& why);

  void write(const RecordPtr& record) override;
  void tick(Nanoseconds now, Nanoseconds horizon) override;
  void finish() override { tick(0, shm::kForever); }

  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] std::uint64_t dumps() const { return dumps_; }

 private:
  void forget_oldest();
  void sum_up(const Record& record);
  void dump(const std::string& why);
  void write_base(evidence::RecordWriter& writer) const;
  [[nodiscard]] std::string path_for(const std::string& why);

  const RingOptions options_;
  std::deque<RecordPtr> records_;
  std::size_t bytes_ = 0;
  std::uint64_t dumps_ = 0;

  // What was so at base_time_, where records_ begin.
  Nanoseconds base_time_ = 0;
  std::optional<evidence::Start> start_;
  std::map<std::string, evidence::SourceState> sources_;
  std::map<std::string, evidence::Missed> untapped_;
  std::optional<evidence::ModelChange> model_;
  std::map<std::pair<bool, std::string>, evidence::PortChange> ports_;
  std::map<std::string, evidence::WinnerChange> winners_;

  std::mutex mutex_;
  struct Request {
    std::string why;
    Nanoseconds time = 0;
  };
  std::vector<Request> requests_;  // under it
};

}  // namespace arbiter::recorder
