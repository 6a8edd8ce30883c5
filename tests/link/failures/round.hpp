// One round: starts the hosts of a plan, troubles them, heals all, and has the recordings checked.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/link/failures/host.hpp"
#include "tests/link/failures/relay.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::failures {

// Times of all rounds, in nanoseconds.
struct Times {
  std::vector<Nanoseconds> each;
  [[nodiscard]] std::string text() const;  // "12: half within 3 ms, the longest 40 ms"
};

struct Totals {
  std::uint64_t rounds = 0;
  std::uint64_t troubles = 0;
  Checked checked;
  Passed passed;
  Times fallbacks;   // from T after the last arrival before a cut to another's command
  Times flows;       // from the end of all troubles until all sources came to all hosts
  Times recoveries;  // from a cut's end, or the first sample after it, to the first arrival
};

class Round {
 public:
  Round(const Options& options, const Plan& plan, Totals& totals);
  ~Round();
  Round(const Round&) = delete;
  Round& operator=(const Round&) = delete;

  [[nodiscard]] Findings run();

 private:
  using Direction = std::pair<unsigned, unsigned>;  // from, to
  struct Ongoing {
    Event event;
    Nanoseconds until = 0;
  };

  [[nodiscard]] FailingHost& host(unsigned number) { return *hosts_[number - 1]; }
  [[nodiscard]] std::vector<Direction> directions_of(const Event& event) const;
  void work();
  void begin(const Event& event);
  void end(const Event& event);
  void change_processes(const Event& event, bool begins);
  void renew_faults();
  void plug_in(unsigned number);
  void heal();
  void await_flow(Findings& found);
  void await_rest();
  void check(Findings& found);
  void check_import(const HostEvidence& importer, unsigned number, const HostEvidence& exporter,
                    unsigned other, Findings& found);
  void measure(const HostEvidence& importer, unsigned number, const HostEvidence& exporter,
               unsigned other, Findings& found);
  enum class Of : std::uint8_t { anything, processes };
  [[nodiscard]] bool is_quiet(unsigned one, unsigned other, const Span& when, Of what) const;
  void keep() const;

  const Options& options_;
  const Plan& plan_;
  Totals& totals_;
  const test::TemporaryDirectory directory_;
  std::vector<std::unique_ptr<FailingHost>> hosts_;
  Relay relay_;  // its thread uses their cables
  Nanoseconds begin_ = 0;
  std::vector<Ongoing> ongoing_;
  std::map<unsigned, bool> is_busy_;  // whether its processes are being troubled
  std::map<Direction, std::vector<Span>> cuts_;
  struct Troubled {
    unsigned host = 0;  // 0: all
    Trouble trouble{};
    Span span;
  };
  std::vector<Troubled> troubled_;
  std::vector<std::vector<FailingHost::Import>> imports_;
};

}  // namespace arbiter::failures
