// A recording in memory: what each source did, what was decided, and by which models.
//
// It takes some 130 bytes for each arrival, in pieces: nothing is copied as it grows. Of a part of
// a recording, only what is in it takes memory. Payloads are not read.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "evidence/record_reader.hpp"
#include "evidence/records.hpp"

namespace arbiter::evidence {

// One step of a source. What it wrote into the activity, it wrote between `time` and `seen`.
struct Step {
  enum class Kind : std::uint8_t { arrival, deactivation, state };
  Nanoseconds time = 0;
  Nanoseconds seen = 0;
  ActivityWord word = shm::kNeverActive;
  Kind kind = Kind::arrival;
  bool is_behind_gap = false;  // between the step before and this one anything may have happened
  std::uint32_t lost = 0;      // events between the two, where this one is a state
  std::uint64_t generation = 0;
};

struct SourceHistory {
  std::deque<Step> steps;  // in the source's order
  // What its page says after them: to deactivate once more is a step, and leaves it.
  shm::ActivityWord word = shm::kNeverActive;
  // From then on it could not be tapped, and still cannot.
  Nanoseconds unknown_from = shm::kForever;
};

// An arrival, with what was decided.
struct Decision {
  const SourceHistory* source = nullptr;
  std::uint32_t step = 0;  // of it
  bool is_sample = false;
  ContextPtr context;
  std::uint64_t sequence = 0;
  shm::Masks masks{};

  [[nodiscard]] const Step& arrival() const { return source->steps[step]; }
};

// From a start to the next, or to the end of the file. Its decisions point into it: a copy's would
// point elsewhere, and a vector that grows copies what may throw where it moves.
struct Run {
  Run() = default;
  Run(Run&&) noexcept = default;
  Run& operator=(Run&&) noexcept = default;

  Nanoseconds start = 0;
  Nanoseconds end = 0;
  // Of a part: steps from then on are there for the decisions alone that were seen later.
  Nanoseconds until = shm::kForever;
  std::vector<std::string> ports;  // patterns of those that were chosen; empty: all
  std::map<std::string, SourceHistory> sources;
  std::deque<Decision> decisions;               // by time
  std::map<std::uint64_t, ModelChange> models;  // by generation
  std::vector<WinnerChange> winners;            // as they were recorded
  std::vector<PortChange> port_changes;         // of input ports, as they were recorded
  // Of output ports, by name, as they were recorded.
  std::map<std::string, std::vector<PortChange>> output_changes;
  // In which events are missing: from its start, where nothing of the source was known before.
  std::vector<Missed> gaps;
  std::uint64_t lost = 0;          // events
  std::uint64_t left_out = 0;      // arrivals of another memory, that of the next run
  std::uint64_t lost_samples = 0;  // whose arrival is there, but not what was in them
};

struct Recorded {
  ReadRecording about;
  std::vector<Run> runs;
};

// What the recorder says that it missed: "3 events and the payloads of 2 samples"; empty: nothing.
[[nodiscard]] std::string missed_text(std::uint64_t events, std::uint64_t samples);
[[nodiscard]] std::string missed_text(const Recorded& recorded);

// What a recording is read for.
enum class Wanted : std::uint8_t { all, winners };  // winners: without most steps and decisions

// Of a part, by the recording's clock: the arrivals in it, what sources did in it, and a state of
// each source for what it did before. A decision in it rests on the same as in the whole recording.
// Runs that lie outside are left out. Throws McapError, RecordError.
[[nodiscard]] Recorded load_recording(const std::string& path, const recording::Watch& watch = {},
                                      Wanted wanted = Wanted::all, const TimeSpan& part = {});

}  // namespace arbiter::evidence
