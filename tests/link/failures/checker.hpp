// What must be true of all hosts' recordings together, whatever befell the links between them. All
// hosts of a test share one clock, so the checker may compare their times. Links never do.
//
// Each function adds a sentence to `found` for each violation, and what it has looked at to
// `checked`.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tests/link/failures/evidence_of_host.hpp"
#include "tests/link/failures/plan.hpp"

namespace arbiter::failures {

struct Checked {
  std::uint64_t arrivals = 0;  // of samples from other hosts
  std::uint64_t old = 0;       // older than half of their T; none is older than T
  std::uint64_t decisions = 0;
  std::uint64_t uncertain = 0;
  std::uint64_t pairs = 0;      // winners, of which no other can have won meanwhile
  std::uint64_t missing = 0;    // samples that never arrived
  std::uint64_t counted = 0;    // as lost, late, too soon
  std::uint64_t unsure = 0;     // arrivals of which the exporter's recording does not have the time
  std::uint64_t shared = 0;     // samples from other hosts of a source that several have open
  std::uint64_t speakers = 0;   // changes of whom they came from
  std::uint64_t switched = 0;   // models that came into force because all hosts were to switch
  std::uint64_t refused = 0;    // switches that no host made
  std::uint64_t partly = 0;     // switches that not all hosts made, or of which that is not known
  std::uint64_t withheld = 0;   // samples that stayed at home, as the last link of each host counts
  std::uint64_t asked = 0;      // of them that won: they are asked for
  std::uint64_t completed = 0;  // of these that came before the next one
  std::uint64_t ends = 0;       // deactivations that came, by what their exporter did
};

using Findings = std::vector<std::string>;

// Whether what was awaited came after a time; how long that took.
struct Recovery {
  bool is_there = false;
  Nanoseconds took = 0;
};

// Nothing is delivered that the host's rules forbid: each decision again, by the host's own model.
void check_decisions(const HostEvidence& host, Findings& found, Checked& checked);

// No two winners, without asking the product's rules: nothing is delivered while a source that
// stands before it is surely active. `rank` and `timeouts` by source: those of lower rank give way.
struct Ranked {
  unsigned rank = 0;
  Nanoseconds timeout = 0;
};
// While `model` is in force; empty: whatever is.
void check_winners(const HostEvidence& host, const std::string& model,
                   const std::map<std::string, Ranked>& ranks, Findings& found, Checked& checked);

// By the time of the arrival: how old it may be.
using MostAge = std::function<Nanoseconds(Nanoseconds)>;
// No arrival is older than that since it was published at `exporter`, whose recording has the
// time.
void check_age(const HostEvidence& importer, const HostEvidence& exporter,
               const std::string& source, const MostAge& most_at, Findings& found,
               Checked& checked);

// In the order in which they were published, and none twice, over all lives of all processes.
void check_order(const HostEvidence& importer, const std::string& source, Findings& found);

// A deactivation comes between the samples between which its exporter has it: it overtakes none,
// and no sample overtakes it. Recordings with gaps tell nothing of them.
void check_ends(const HostEvidence& importer, const HostEvidence& exporter,
                const std::string& source, Findings& found, Checked& checked);

// Signals of withheld samples that won, and whether the sample was the next to come.
struct Asked {
  Nanoseconds when = 0;
  bool is_completed = false;
};
[[nodiscard]] std::vector<Asked> asked_for(const HostEvidence& importer, const std::string& source);

// Deactivations of a source by its own publisher, each until its next event.
struct End {
  Nanoseconds when = 0;
  Nanoseconds until = 0;
};
[[nodiscard]] std::vector<End> ends_of(const HostEvidence& exporter, const std::string& source);
// The first deactivation at an importer that is not older; or arrival of what is newer, if that is
// enough.
[[nodiscard]] Recovery first_end_after(const HostEvidence& importer, const std::string& source,
                                       Nanoseconds time, bool or_newer);

// Samples that did not arrive, between others that did, were counted, to the last one. `spans`:
// times in which the process that counts was not there, or was another one; what is missing there
// it may not know of.
struct Span {
  Nanoseconds from = 0;
  Nanoseconds to = 0;
};
void check_losses(const HostEvidence& importer, const std::string& source, std::uint64_t counted,
                  const std::vector<Span>& spans, Findings& found, Checked& checked);

// No more was counted than what was published since `since` and did not arrive, and `joins`: what
// an exporter says of a source's state when somebody joins may be lost as well.
void check_counts(const HostEvidence& importer, const HostEvidence& exporter,
                  const std::string& source, std::uint64_t counted, std::uint64_t joins,
                  Nanoseconds since, Findings& found);

// Nothing that was published in a cut has arrived before its end: else the cable was no cable.
void check_cuts(const HostEvidence& importer, const std::string& source,
                const std::vector<Span>& cuts, Findings& found);

// When its port was closed.
[[nodiscard]] Recovery closed_after(const HostEvidence& importer, const std::string& source,
                                    Nanoseconds time);
// It arrived in the 100 ms before.
[[nodiscard]] bool was_there(const HostEvidence& importer, const std::string& source,
                             Nanoseconds time);

[[nodiscard]] Recovery first_arrival_after(const HostEvidence& host, const std::string& source,
                                           Nanoseconds time);
// Likewise, from the first event that its exporter published after that time; a silence of the
// exporter just before what arrived first does not count: the way may have been free in it.
[[nodiscard]] Recovery recovery_after(const HostEvidence& importer, const HostEvidence& exporter,
                                      const std::string& source, Nanoseconds time);
// Since when no source but `last` can have been active any more, and how long after that `last`
// commanded. Where nobody's rule holds `last` up for less than `least`, there is none.
struct Fallback {
  Nanoseconds since = 0;
  Recovery next;
};
[[nodiscard]] std::vector<Fallback> fallbacks(const HostEvidence& host,
                                              const std::map<std::string, Ranked>& ranks,
                                              const std::string& last, Nanoseconds least);

}  // namespace arbiter::failures
