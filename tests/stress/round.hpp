// One round: starts a daemon and the components of a plan, troubles them, ends them in order, and
// has what they did checked.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/stress/accounts.hpp"
#include "tests/stress/history.hpp"
#include "tests/stress/options.hpp"
#include "tests/stress/plan.hpp"
#include "tests/stress/records.hpp"
#include "tests/stress/tap_accounts.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::stress {

// How long what took: by powers of two of nanoseconds, and the longest.
struct Distribution {
  std::uint64_t longest = 0;
  std::array<std::uint64_t, Pauses::kBuckets> buckets{};

  void add(std::uint64_t nanoseconds);
  void add(const Pauses& pauses);
  [[nodiscard]] std::uint64_t count() const;
  // Below so many ns were at least this share of them.
  [[nodiscard]] std::uint64_t quantile(double share) const;
};

// Of all rounds so far.
struct Totals {
  std::uint64_t rounds = 0;
  Checked checked;
  TapsChecked taps;
  std::uint64_t steps = 0;
  std::uint64_t swaps = 0;
  std::uint64_t kills = 0;
  std::uint64_t killed_publishers = 0;
  std::uint64_t killed_receivers = 0;
  std::uint64_t killed_relays = 0;
  std::uint64_t killed_taps = 0;
  std::uint64_t stops = 0;
  std::uint64_t daemon_kills = 0;
  Distribution readoptions;        // from a new daemon's start until it knew all ports
  Distribution takeovers;          // from a kill until the successor's ports were open
  Distribution pauses;             // of all components, in rounds without trouble
  Distribution pauses_in_trouble;  // of those that were not killed or stopped themselves

  [[nodiscard]] std::uint64_t operations() const { return checked.arrivals + checked.takes; }
};

class Round {
 public:
  Round(const Options& options, const Plan& plan, Records& records, Totals& totals);
  ~Round();
  Round(const Round&) = delete;
  Round& operator=(const Round&) = delete;

  // With so many more kills or stops, if time allows.
  void run(std::uint64_t kills, std::uint64_t stops, bool kill_daemon);

 private:
  void start(std::uint32_t component);
  void wait_until_open(std::uint32_t component);
  [[nodiscard]] bool is_open(std::uint32_t component) const;
  [[nodiscard]] bool is_full() const;
  void work(std::uint64_t kills, std::uint64_t stops, bool kill_daemon);
  void swap_model();
  bool kill_one();
  void note_takeovers();
  void stop_one();
  void kill_daemon();
  void replace_daemon();
  [[nodiscard]] bool has_all_ports(const nlohmann::json& status) const;
  void wait_for_steps(std::uint64_t count, std::uint32_t of_all_but) const;
  void wait_for_all_done(Phase phase);
  void meet_daemon();
  PortIds port_ids();
  void check();
  void check_accounts();
  void add_up();

  const Options& options_;
  const Plan& plan_;
  Records& records_;
  Totals& totals_;
  test::Daemon daemon_;
  std::unique_ptr<test::RawClient> client_;
  shm::Mapping board_;
  Accounts accounts_;
  Random random_;
  std::vector<Swap> swaps_;
  std::vector<pid_t> processes_;
  std::vector<std::thread> threads_;
  std::vector<std::uint32_t> incarnations_;
  std::vector<std::int64_t> killed_at_;  // 0: its takeover is noted
  std::vector<bool> troubled_;           // was killed or stopped
  bool daemon_lives_ = true;
  PortIds port_ids_;
};

}  // namespace arbiter::stress
