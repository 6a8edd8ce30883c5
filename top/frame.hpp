// What is shown: what the daemon counts, once a second (Census), and what decides, in between
// (Frame). Values, which nobody changes once they are made, so that a picture can be kept.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "shm/activity.hpp"
#include "wire/status.hpp"

namespace arbiter::top {

// Counts per second between two status documents. None: the port was not open in both.
struct PortRates {
  double taken = 0;
  double lost = 0;       // accepted, and never taken: dropped, overtaken; refused by a full queue
  double discarded = 0;  // of the losers
};
struct SourceRates {
  double published = 0;
  double signals = 0;
};

struct PortFact {
  std::string name;
  std::string component;  // "arm-control (pid 42)"; "away", "not open"
  bool is_open = false;
  bool is_arbitrated = false;
  std::optional<PortRates> rates;
  std::uint64_t waiting = 0;                                  // samples, on all its connections
  std::vector<std::pair<std::string, std::uint64_t>> queues;  // by source, those with samples
  std::uint64_t depth = 0;                                    // of the deepest queue
  std::string useless;  // a source that is selected, and cannot deliver
  std::string why_useless;
};

struct SourceFact {
  std::string name;
  std::string component;
  std::string host;  // another one, from which arbiter-link has it; "": a component of this one
  bool is_open = false;
  shm::Nanoseconds timeout = 0;
  std::optional<SourceRates> rates;
  std::vector<std::string> ports;  // that it is connected to, or that read it
};

struct Census {
  shm::Nanoseconds at = 0;  // CLOCK_MONOTONIC, when it came
  shm::Nanoseconds asked = 0;
  std::string instance;
  std::string model;  // `model 2 "work"`
  // Since when the model in force has been so, if no other one was before it; else 0.
  shm::Nanoseconds first_model_since = 0;
  // Components that the daemon does not know: they go on by the memory of one before.
  std::size_t strangers = 0;
  std::vector<PortFact> ports;  // by name
  std::vector<SourceFact> sources;

  [[nodiscard]] std::ptrdiff_t find_port(const std::string& name) const;
  [[nodiscard]] std::ptrdiff_t find_source(const std::string& name) const;
};

struct StampedStatus {
  wire::Status status;
  shm::Nanoseconds asked = 0;
  shm::Nanoseconds at = 0;
  std::chrono::system_clock::time_point wall;
};
// `before`: the one that rates are taken from, if any.
[[nodiscard]] Census census_of(const StampedStatus& now, const StampedStatus* before);

// Who commands a port, as an index of Census::sources, or:
inline constexpr std::int32_t kNobody = -1;
inline constexpr std::int32_t kNotArbitrated = -2;
inline constexpr std::int32_t kNotKnown = -3;  // its sources have not all come yet

// How long samples waited at a tapped port, from publish to take.
struct Waits {
  shm::Nanoseconds half = 0;    // of them waited less than this
  shm::Nanoseconds almost = 0;  // 99 of 100 did
};

struct PortState {
  std::int32_t winner = kNotKnown;
  shm::Nanoseconds since = 0;  // 0: not known
  bool is_exact = false;       // else: at the latest
  bool is_tapped = false;
  // Of a tapped port: how long at most the oldest sample in its queues had waited when the census
  // was taken; 0: none waited. Nothing where the tap is too young to know.
  std::optional<shm::Nanoseconds> oldest{};
  std::optional<Waits> waits{};  // the same; nothing where none was taken lately
};

struct Frame {
  shm::Nanoseconds now = 0;  // CLOCK_MONOTONIC
  std::chrono::system_clock::time_point wall;
  std::shared_ptr<const Census> census;
  std::vector<PortState> ports;          // as in the census
  std::vector<shm::ActivityWord> words;  // as Census::sources
  // As Census::sources: how far apart arrivals are, if that is more than T; 0: it is not.
  std::vector<shm::Nanoseconds> slow_periods;
  std::uint64_t generation = 0;  // of the model in force
  std::uint64_t memories = 0;    // of daemons that had been seen: each numbers its models
  std::uint64_t takeovers = 0;   // that there had been
  bool has_daemon = true;
  bool is_counted = true;  // lately; else what the daemon counts is not known any more
  bool is_settled = true;

  // When the source last arrived, or was deactivated; 0: never.
  [[nodiscard]] shm::Nanoseconds last_event(std::size_t source) const;
  [[nodiscard]] shm::Nanoseconds slow_period(std::size_t source) const {
    return source < slow_periods.size() ? slow_periods[source] : 0;
  }
};

// An arrival that was accepted: its source won then.
struct Accepted {
  std::string port;
  std::string source;
  shm::Nanoseconds at = 0;
  bool is_sample = true;         // else a signal, which no queue has
  std::uint64_t generation = 0;  // of the model that accepted it
};

// A change of the winner.
struct Takeover {
  std::uint64_t number = 0;  // counts them from 1
  shm::Nanoseconds at = 0;
  std::chrono::system_clock::time_point wall;
  std::string port;
  std::string before;  // "": nobody
  std::string winner;
  std::string because;  // "/Object/pos:o became active"
};

// Why somebody wins, or does not.
struct WhyQuestion {
  std::vector<std::string> ports;
  std::string source;                     // only of its connection; "": of all
  std::shared_ptr<const Frame> moment{};  // that the answer is to be of; null: now
  std::vector<std::string> seen{};        // what the asker knows already, a line for each port
};
struct WhyReply {
  WhyQuestion question;
  std::vector<std::string> lines;
};

}  // namespace arbiter::top
