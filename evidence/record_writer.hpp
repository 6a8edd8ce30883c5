// Writes records into a container file.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <unordered_map>

#include "evidence/record_schemas.hpp"
#include "evidence/records.hpp"
#include "recording/mcap.hpp"

namespace arbiter::evidence {

// What the whole file is about.
struct RecordingInfo {
  std::string program = "arbiter";  // that writes it
  std::string instance;
  std::string host;
  std::string command;
  // Added to a time of CLOCK_MONOTONIC gives nanoseconds since 1970. One for the whole file: where
  // the wall clock is set meanwhile, the times of the file go on evenly.
  std::int64_t wall_offset = 0;
  // For people, a sentence each: what the file has no room for.
  std::function<void(const std::string&)> say{};
};

// Copies no payload.
[[nodiscard]] Arrival without_payload(const Arrival& from);

// The offset as it is now.
[[nodiscard]] std::int64_t wall_offset_now();

// Threads: one at a time. All calls throw McapError.
class RecordWriter {
 public:
  RecordWriter(const std::string& path, const recording::McapOptions& options,
               const RecordingInfo& info);

  // Where the file has no room for the payloads of one more source or type, their arrivals say so.
  void write(const Record& record);
  // What was written until now survives a kill of this process; with sync(), a power cut.
  void end_chunk() { file_.end_chunk(); }
  void sync() { file_.sync(); }
  // `end`: what had happened by then is in it; 0: that is not known.
  void close(Nanoseconds end = 0);
  [[nodiscard]] std::uint64_t bytes() const noexcept { return file_.bytes(); }
  [[nodiscard]] std::uint64_t count_of(RecordKind kind) const noexcept {
    return counts_[static_cast<std::size_t>(kind)];
  }

 private:
  void write_json(RecordKind kind, Nanoseconds time, const std::string& json);
  void write_record(const Record& record);
  void leave_out_payload(const Arrival& arrival);
  [[nodiscard]] ModelChange without_texts(const ModelChange& model) const;
  std::uint16_t channel_of(const SourceContext& context);

  recording::McapWriter file_;
  std::int64_t wall_offset_;
  std::function<void(const std::string&)> say_;
  Nanoseconds start_ = 0;  // of the recording
  std::uint16_t channels_[kRecordKinds]{};
  std::uint64_t counts_[kRecordKinds]{};
  std::map<std::string, std::uint16_t> types_;  // schemas of payloads
  // By source and type: a successor may have another type.
  std::map<std::string, std::uint16_t> payload_channels_;
  bool is_full_ = false;  // it takes no more of these
  std::string json_;      // its memory is used again
};

}  // namespace arbiter::evidence
