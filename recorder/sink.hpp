// Where records go: a file, or the memory of a flight recorder.
#pragma once

#include <cstdint>
#include <string>

#include "evidence/record_writer.hpp"
#include "recorder/record_queue.hpp"

namespace arbiter::recorder {

// One thread at a time.
class Sink {
 public:
  Sink() = default;
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;
  virtual ~Sink() = default;
  // In the order of time; those of one source in its order.
  virtual void write(const RecordPtr& record) = 0;
  // At least every tenth of a second. `horizon`: what happened before has been written.
  virtual void tick(Nanoseconds now, Nanoseconds horizon) = 0;
  // `horizon`: as above, in the end; 0: not known.
  virtual void finish(Nanoseconds horizon) = 0;
};

// What was written survives a kill of this program after a second, and a power cut after five.
class FileSink : public Sink {
 public:
  // Throws McapError, as all calls.
  FileSink(const std::string& path, const recording::McapOptions& options,
           const evidence::RecordingInfo& info)
      : writer_(path, options, info) {}

  void write(const RecordPtr& record) override {
    writer_.write(*record);
    bytes_ = writer_.bytes();
  }
  void tick(Nanoseconds now, Nanoseconds horizon) override;
  void finish(Nanoseconds horizon) override;
  [[nodiscard]] const evidence::RecordWriter& writer() const { return writer_; }

 private:
  evidence::RecordWriter writer_;
  std::uint64_t bytes_ = 0;
  std::uint64_t bytes_at_chunk_ = 0;
  Nanoseconds last_chunk_ = 0;
  Nanoseconds last_sync_ = 0;
};

}  // namespace arbiter::recorder
