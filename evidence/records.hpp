// What a recording tells: one type for each kind of record.
//
// Times are nanoseconds of CLOCK_MONOTONIC. `time` is when something happened; `seen`, when the
// recorder knew of it, read after the event had come. So what an arrival did to the activity of its
// source, and the decisions about it, happened between the two: replaying a recording rests on
// that (judge.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "evidence/rule_table.hpp"
#include "shm/activity.hpp"
#include "shm/event_segment.hpp"

namespace arbiter::evidence {

using shm::ActivityWord;
using shm::Nanoseconds;

// From one moment to before another.
struct TimeSpan {
  Nanoseconds from = 0;
  Nanoseconds to = shm::kForever;

  [[nodiscard]] bool has(Nanoseconds time) const { return time >= from && time < to; }
};

// What the records of a source have in common until its destinations change.
struct SourceContext {
  std::string source;
  // A publisher has told of what follows. Of a source that nobody has open, or of which only the
  // page of its activity was read, it is not known.
  bool is_described = false;
  std::string type;  // empty: untyped
  std::uint64_t size = 0;
  std::uint64_t alignment = 1;
  std::vector<std::string> destinations;  // names of input ports, by bit of the masks; at most 64
};
using ContextPtr = std::shared_ptr<const SourceContext>;

// A recorder begins to watch: at the beginning, and where a daemon has come with memory of its own,
// of which nothing before holds. The states of all sources follow.
struct Start {
  Nanoseconds time = 0;
  std::string instance;
  std::vector<std::string> ports;  // patterns; empty: all
  std::string payloads;            // "all", "none" or a pattern
};

struct Arrival {
  ContextPtr context;
  Nanoseconds time = 0;
  Nanoseconds seen = 0;
  bool is_sample = false;  // else a signal
  std::uint64_t sequence = 0;
  std::uint64_t size = 0;
  std::uint64_t generation = 0;
  ActivityWord word = shm::kNeverActive;  // after it
  shm::Masks masks{};
  shm::SampleOrigin origin{};  // publisher 0: it began here
  bool has_payload = false;    // in the file
  std::optional<std::vector<std::byte>> payload{};
};

struct Deactivation {
  ContextPtr context;
  Nanoseconds time = 0;
  Nanoseconds seen = 0;
  std::uint64_t sequence = 0;
  std::uint64_t generation = 0;
};

// What a source is like.
struct SourceState {
  enum class Why : std::uint8_t {
    page,    // by the page of its activity, which was read
    joined,  // by its publisher, where it begins to tell
    gap,     // by its publisher, behind events that were lost
    closed,  // by its publisher, which has gone
  };
  ContextPtr context;
  Nanoseconds time = 0;  // of its last arrival or deactivation; 0: not known
  Nanoseconds seen = 0;
  Why why = Why::page;
  std::uint64_t sequence = 0;
  std::uint64_t generation = 0;
  std::uint64_t lost = 0;  // events immediately before
  ActivityWord word = shm::kNeverActive;
};

struct DestinationsChange {
  ContextPtr context;
  Nanoseconds time = 0;
  Nanoseconds seen = 0;
};

// By what the daemon says of its ports.
struct PortChange {
  enum class What : std::uint8_t { open, opened, closed, died };  // open: when watching began
  What what = What::opened;
  bool is_input = false;
  std::string port;
  std::string node;
  std::int64_t pid = 0;
  std::string type;  // empty: untyped
  Nanoseconds seen = 0;
  std::string host{};  // from which a link imports it; empty: a component of this host has it open
};

struct ModelFile {
  std::string path;
  std::string text;
};

struct ModelChange {
  Nanoseconds time = 0;  // in force since
  Nanoseconds seen = 0;
  std::uint64_t generation = 0;  // 0: no model is in force
  std::string name;
  std::string how;
  std::string by;
  bool has_texts = false;  // else the daemon knows its decisions only
  std::vector<ModelFile> files;
  std::optional<ModelFile> application{};
  std::shared_ptr<const RuleTable> table{};  // not in the file
};

struct WinnerChange {
  enum class Why : std::uint8_t { start, arrival, expiry, deactivation, model, state };
  std::string port;
  std::string winner;  // empty: none
  std::string before;
  Nanoseconds time = 0;
  Why why = Why::start;
  std::string by;  // the source that arrived, ended or was deactivated
  std::uint64_t generation = 0;
};

// What is not in the recording though it happened.
struct Missed {
  enum class Why : std::uint8_t {
    overtaken,  // the recorder read too slowly
    queue,      // it could not write as fast as it read
    refused,    // the source cannot be tapped: `text` says why
    stranger,   // its component is one that the daemon does not know: `text` says which
    too_large,  // no reader would be ready for so much
    memory,     // there was no room for it in a flight recorder's memory
    other,      // of a later version
  };
  std::string source;
  Nanoseconds from = 0;
  Nanoseconds to = 0;
  std::uint64_t events = 0;   // arrivals, deactivations
  std::uint64_t samples = 0;  // whose arrival is here, but not what was in them
  Why why = Why::overtaken;
  std::string text;
};

using Record = std::variant<Start, Arrival, Deactivation, SourceState, DestinationsChange,
                            PortChange, ModelChange, WinnerChange, Missed>;
using RecordPtr = std::shared_ptr<const Record>;

// When it happened; where that is not known, when it was seen.
[[nodiscard]] Nanoseconds time_of(const Record& record);
// The source that it is about; null: none.
[[nodiscard]] const SourceContext* context_of(const Record& record);
// Bytes that it takes up in memory, roughly.
[[nodiscard]] std::size_t size_of(const Record& record);
// Those of its payload alone.
[[nodiscard]] std::size_t payload_size_of(const Record& record);

[[nodiscard]] std::string_view name_of(SourceState::Why why);
[[nodiscard]] std::string_view name_of(PortChange::What what);
[[nodiscard]] std::string_view name_of(WinnerChange::Why why);
[[nodiscard]] std::string_view name_of(Missed::Why why);

}  // namespace arbiter::evidence
