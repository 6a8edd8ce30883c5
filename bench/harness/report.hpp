// What was measured, as it is written to report.json and drawn in report.html.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "bench/harness/histogram.hpp"

namespace arbiter::bench {

enum class Role {
  kOurs,
  kPeer,   // what one would use instead
  kFloor,  // what the machine does without anybody's help: nothing of the kind can be faster
};

// Said only where at least ten samples lie behind it: of fewer, it is the word of one or two.
struct Tail {
  const char* name;
  double share;
  std::uint64_t least;  // samples

  [[nodiscard]] bool is_known(const Histogram& ns) const { return ns.count() >= least; }
};
inline constexpr Tail kTail99{"p99", 0.99, 1'000};
inline constexpr Tail kTail999{"p99.9", 0.999, 10'000};
inline constexpr Tail kTails[] = {{"p90", 0.9, 100},
                                  kTail99,
                                  kTail999,
                                  {"p99.99", 0.9999, 100'000},
                                  {"p99.999", 0.99999, 1'000'000}};

// Of one system in one case.
struct Result {
  std::string system;
  Role role = Role::kOurs;
  Histogram ns;                   // durations; empty where it is `value` that was measured
  std::optional<double> value{};  // in the measure's unit
  std::string note{};             // why there is no result, or what to know about it
};

// The systems side by side under the same circumstances.
struct Case {
  std::string name;           // "64 B, spinning"
  std::optional<double> x{};  // where the cases of a measure form a curve: bytes, sources, ...
  std::vector<Result> results{};
  std::string unit{};  // of values, where it is another than the measure's

  [[nodiscard]] const Result* find(const std::string& system) const;
};

struct Measure {
  std::string name;         // "delivery": for --only, and in the JSON
  std::string title;        // "One-way delivery"
  std::string explanation;  // what exactly was measured, in a sentence or two
  std::string unit = "ns";  // of values
  std::string x_label{};    // "bytes"
  std::vector<Case> cases{};

  [[nodiscard]] const Case* find(const std::string& name) const;
};

// A Verdict::group: what a gateway costs beside a relay.
inline constexpr const char* kGateways = "gateways";

// Something that the project has promised, and whether it held in this run.
struct Verdict {
  std::string name;  // "64 B spinning, p50, to iceoryx"
  double limit = 0;
  std::optional<double> measured{};  // empty: could not be measured
  std::string unit{};                // "x" for ratios
  std::string group{};               // those of one stand together in the picture: kGateways

  [[nodiscard]] bool is_met() const { return measured && *measured <= limit; }
};

struct Report {
  bool quick = false;
  nlohmann::json machine;             // machine.hpp
  std::vector<std::string> warnings;  // what may have spoilt the figures
  std::vector<Measure> measures;
  std::vector<Verdict> targets;

  [[nodiscard]] const Measure* find(const std::string& name) const;
  [[nodiscard]] nlohmann::json json() const;
};

}  // namespace arbiter::bench
