// What is wrong with what the hosts of a round recorded, and how long things took.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/link/failures/checker.hpp"
#include "tests/link/failures/history.hpp"
#include "tests/link/failures/relay.hpp"

namespace arbiter::failures {

// Times of all rounds, in nanoseconds.
struct Times {
  std::vector<Nanoseconds> each;
  std::uint64_t starved = 0;  // beyond the bound, where processes waited for a processor
  [[nodiscard]] std::string text() const;  // "12: half within 3 ms, all within 40 ms"
};

// How often it happened, by how long it lasted.
struct Happenings {
  std::array<std::uint64_t, 4> lasting{};
  std::uint64_t skipped = 0;  // something else befell the host's processes
  void add(Nanoseconds lasts);
  static constexpr std::array<const char*, 4> kNames{"< 1 s", "1 s", "10 s", "60 s"};
};

struct Totals {
  std::uint64_t rounds = 0;
  std::map<unsigned, std::uint64_t> rounds_of;  // by the number of hosts
  std::uint64_t rounds_with_losers = 0;
  std::uint64_t late_interfaces = 0;
  std::map<Trouble, Happenings> troubles;
  Checked checked;
  Passed passed;
  Times fallbacks;    // from when nothing else could be active to the last one's command
  Times ends;         // from a deactivation, or the end of the trouble, to its coming elsewhere
  Times flows;        // from the end of all troubles until all sources came to all hosts
  Times closings;     // from a cut until the port of a source whose T is forever was closed
  Times successions;  // from when a speaker went to another one's first sample
  // From the trouble's end, or the first sample after it, to the first arrival.
  std::map<Trouble, Times> recoveries;
};

class Judge {
 public:
  Judge(const Options& options, const Plan& plan, const History& history, Totals& totals);
  // Of all hosts, by number - 1.
  [[nodiscard]] Findings judge(const std::vector<HostEvidence>& hosts);

 private:
  struct Pair {
    const HostEvidence& importer;
    const HostEvidence& exporter;
    unsigned number;  // of the importer
    unsigned other;   // of the exporter
    std::string source;
  };
  void judge_commands(const HostEvidence& host, unsigned number);
  void judge_fallbacks(const HostEvidence& host, unsigned number,
                       const std::map<std::string, Ranked>& ranks, const std::string& last);
  void judge_import(const Pair& pair);
  void judge_losers(const Pair& pair);
  void judge_ends(const Pair& pair);
  void judge_shared(const Pair& pair);
  void judge_closing(const Pair& pair, const Direction& direction);
  // T of its source at the importer; nothing: more than one model may have been in force.
  [[nodiscard]] std::optional<Nanoseconds> timeout_in(const Pair& pair, const Span& when) const;
  // How old a sample may be that arrives then.
  [[nodiscard]] Nanoseconds most_age(const Pair& pair, Nanoseconds time) const;
  void judge_successions(const HostEvidence& host, unsigned number);
  void measure(const Pair& pair);
  void measure_one(const Pair& pair, Trouble trouble, const Span& span);
  // All of both hosts, and of what passes their frames on.
  [[nodiscard]] Nanoseconds waited(unsigned one, unsigned other, const Span& when) const;
  // Adds what it took, and a finding where that is more than `most` and they were not starved.
  void hold_to(Times& times, const Recovery& recovery, Nanoseconds most, Nanoseconds waited,
               const std::string& what);

  const Options& options_;
  const Plan& plan_;
  const History& history_;
  Totals& totals_;
  Findings found_;
};

}  // namespace arbiter::failures
