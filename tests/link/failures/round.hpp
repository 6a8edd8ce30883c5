// One round: starts the hosts of a plan, troubles them, heals all, and has the recordings checked.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/link/failures/host.hpp"
#include "tests/link/failures/judge.hpp"
#include "tests/link/failures/operators.hpp"
#include "tests/link/failures/relay.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::failures {

class Round {
 public:
  Round(const Options& options, const Plan& plan, Totals& totals);
  ~Round();
  Round(const Round&) = delete;
  Round& operator=(const Round&) = delete;

  [[nodiscard]] Findings run();

 private:
  struct Ongoing {
    Event event;
    Nanoseconds until = 0;
  };

  [[nodiscard]] FailingHost& host(unsigned number) { return *hosts_[number - 1]; }
  [[nodiscard]] std::vector<Direction> directions_of(const Event& event) const;
  void work();
  void begin(const Event& event);
  // Whether there is nothing more to wait for.
  bool end(const Event& event);
  void change_processes(const Event& event, bool begins);
  void renew_faults();
  void plug_in(unsigned number);
  void heal();
  void await_flow(Findings& found);
  void await_rest();
  void name_large(std::vector<HostEvidence>& evidence) const;
  void check(Findings& found);
  void pass(Nanoseconds time);
  void change_shared(const Event& event, bool begins);
  void begin_switch(const Event& event);
  void note_end(const Event& event);
  void keep() const;

  const Options& options_;
  const Plan& plan_;
  Totals& totals_;
  const test::TemporaryDirectory directory_;
  std::vector<std::unique_ptr<FailingHost>> hosts_;
  Relay relay_;  // its thread uses their cables
  Nanoseconds begin_ = 0;
  std::vector<Ongoing> ongoing_;
  std::map<unsigned, bool> is_busy_;     // whether its processes are being troubled
  std::map<unsigned, bool> is_sharing_;  // whether its rival is being troubled
  Operators operators_;
  History history_;
};

}  // namespace arbiter::failures
