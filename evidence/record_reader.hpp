// Reads records from a container file. What a file says is judged before it is used: anybody may
// have made it.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "evidence/record_error.hpp"
#include "evidence/records.hpp"
#include "recording/mcap.hpp"

namespace arbiter::evidence {

struct ReadRecording {
  std::string instance;
  std::string host;
  std::int64_t wall_offset = 0;
  Nanoseconds recorded_until = 0;  // 0: the file does not say
  std::uint64_t records = 0;
  recording::McapEnd end;  // a file that was cut short is read up to its last whole chunk
};

enum class Payloads : std::uint8_t { pass_over, read };

// Calls `use` for each record, in the file's order, which for those of one source is the order in
// which they happened. Of arrivals and deactivations outside `events`, which are passed over faster
// than others are read, only those that decide what a source is like in front of what may rest on
// it: its last arrival, and a deactivation behind that. Throws McapError, RecordError.
ReadRecording read_recording(const std::string& path, Payloads payloads,
                             const std::function<void(Record&&)>& use,
                             const recording::Watch& watch = {}, const TimeSpan& events = {});

}  // namespace arbiter::evidence
