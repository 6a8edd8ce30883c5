// The status document: what a daemon knows of its models, its ports, their connections and
// counters.
//
// docs/status.md says what each field means and when it is there; status.cpp names them once, for
// both directions. Counters are counts of samples unless they say something else. What an older
// daemon does not send: a counter is 0, anything else is an error that names it. What a newer one
// sends besides is passed over.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "shm/activity.hpp"
#include "wire/past_model.hpp"

namespace arbiter::wire {

// Who has a port open.
struct Component {
  std::string node;
  std::int32_t pid = 0;
  std::uint32_t user = 0;  // a uid
};

struct SampleType {
  std::string name;
  std::uint64_t size = 0;  // bytes
  std::uint64_t alignment = 0;
};

// Why the daemon has a predecessor's model in force, and not its own.
struct RefusedFilesStatus {
  std::vector<std::string> files;  // of all its models, as it was given them
  std::string why;                 // the first error, and where it is
};

struct ModelStatus {
  std::uint64_t generation = 0;  // 0: no model is in force
  std::optional<std::string> name;
  std::uint64_t reloads_refused = 0;
  std::vector<std::string> files;
  std::optional<std::string> application;
  std::optional<RefusedFilesStatus> refused;  // none: it has been given no files, or has read them
};

struct LoadedModelStatus {
  std::string name;
  bool in_force = false;
  bool as_loaded = false;
  std::vector<std::string> files;
  std::optional<std::string> application;
};

// A component of an earlier daemon that this one cannot take back.
struct StrangerStatus {
  std::string node;
  std::int32_t pid = 0;
  std::uint32_t user = 0;
  std::string why;
  shm::Nanoseconds since = 0;  // CLOCK_MONOTONIC
  shm::Nanoseconds seen = 0;
  std::vector<std::string> outputs;
  std::vector<std::string> inputs;
};

// A component that ended without closing its ports.
struct DeathStatus {
  std::string node;
  std::int32_t pid = 0;
  std::uint32_t user = 0;
  shm::Nanoseconds at = 0;  // CLOCK_MONOTONIC: when the daemon learned of it
  std::vector<std::string> outputs;
  std::vector<std::string> inputs;
  std::vector<std::string> opened_since;  // of both, by anybody
};

// A port that a component has asked for and was refused. It has one of the two.
struct RefusalStatus {
  std::string node;
  std::int32_t pid = 0;
  std::uint32_t user = 0;
  shm::Nanoseconds at = 0;  // CLOCK_MONOTONIC: when it asked last
  std::string why;
  std::optional<std::string> output;
  std::optional<std::string> input;
};

// An output port that a component has open.
struct OpenOutput {
  Component component;
  std::vector<Component> taps;     // who watches it
  std::optional<SampleType> type;  // none: untyped
  std::uint64_t max_size = 0;      // bytes of the largest sample
  std::uint64_t published = 0;
  std::uint64_t signals = 0;
  std::uint64_t delivered = 0;
  std::uint64_t discarded = 0;
  std::uint64_t refused = 0;
  std::uint64_t blind = 0;
  std::uint64_t unsettled = 0;
  std::uint64_t no_slot = 0;
  std::uint64_t late = 0;
  std::optional<std::string> described;  // by its component: what stands behind it
  std::optional<bool> trouble;           // it is something that is wrong
};

struct SourceStatus {
  std::string name;
  bool mentioned = false;
  bool active = false;
  shm::Nanoseconds timeout = 0;          // T; shm::kForever
  std::optional<std::int32_t> away_pid;  // of a component that has not come back yet
  std::optional<OpenOutput> open;
};

// What stands at one end of a connection.
enum class End : std::uint8_t { kOpen, kAway, kClosed };

struct ConnectionStatus {
  std::string source;
  bool active = false;
  bool winner = false;
  End output = End::kClosed;
  End input = End::kClosed;
  std::optional<std::string> mismatch;  // why two open ends are not connected
  std::optional<std::uint32_t> depth;   // none while they are not connected
  std::uint64_t accepted = 0;
  std::uint64_t discarded = 0;
  std::uint64_t refused = 0;
  std::uint64_t taken = 0;
  std::uint64_t dropped = 0;
  std::uint64_t overtaken = 0;
  std::uint64_t waiting = 0;  // in the queue now

  [[nodiscard]] bool is_connected() const {
    return output == End::kOpen && input == End::kOpen && !mismatch;
  }
  // "connected", "mismatch", "input port not open", …
  [[nodiscard]] std::string state() const;
};

struct SensedStatus {
  std::string source;
  bool active = false;
};

enum class WhenFull : std::uint8_t { kDropOldest, kRefuseNew };

// An input port that a component has open.
struct OpenInput {
  Component component;
  std::optional<SampleType> type;  // none: untyped
  std::uint32_t depth = 0;
  bool keep = false;
  WhenFull when_full = WhenFull::kDropOldest;
  std::uint64_t taken = 0;
  std::uint64_t dropped = 0;
  std::uint64_t overtaken = 0;
  std::uint64_t blind = 0;       // takes
  std::uint64_t unsettled = 0;   // takes
  std::uint64_t misbehaved = 0;  // entries of queues
  std::uint64_t idles = 0;       // times that the component was told
  std::optional<std::string> described;
  std::optional<bool> trouble;
};

// A connection that is selected, and cannot deliver.
struct UselessWinner {
  std::string source;
  std::string why;
};

struct InputStatus {
  std::string name;
  bool mentioned = false;
  bool arbitrated = false;
  bool in_order = false;
  bool idle = false;
  std::optional<std::string> winner;
  std::optional<UselessWinner> cannot_deliver;
  std::vector<ConnectionStatus> connections;
  std::vector<SensedStatus> senses;
  std::optional<std::int32_t> away_pid;
  std::optional<OpenInput> open;
};

struct Status {
  std::string instance;
  std::int32_t pid = 0;
  std::string directory;                // empty: not known
  std::optional<shm::Nanoseconds> now;  // CLOCK_MONOTONIC there; an older daemon does not say it
  ModelStatus model;
  std::vector<LoadedModelStatus> models;
  std::vector<PastModelStatus> history;  // the latest first
  std::uint64_t clients = 0;
  std::vector<StrangerStatus> strangers;
  std::vector<DeathStatus> deaths;      // the latest first
  std::vector<RefusalStatus> refusals;  // the latest first
  std::vector<SourceStatus> sources;
  std::vector<InputStatus> inputs;

  // Null: it has none of that name. A search from the first to the last.
  [[nodiscard]] const SourceStatus* find_source(std::string_view name) const;
  [[nodiscard]] const InputStatus* find_input(std::string_view name) const;
};

[[nodiscard]] nlohmann::json to_json(const Status& status);
// Parts of it.
[[nodiscard]] nlohmann::json to_json(const PastModelStatus& model);
[[nodiscard]] nlohmann::json to_json(const std::vector<LoadedModelStatus>& models);
[[nodiscard]] nlohmann::json to_json(const std::vector<PastModelStatus>& history);

// Throws DocumentError.
[[nodiscard]] Status read_status(std::string_view text);

}  // namespace arbiter::wire
