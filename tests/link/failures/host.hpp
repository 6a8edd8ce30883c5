// One host of a round: a network, a daemon, a link, a component, and a recorder, which is no part
// of what is troubled.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/link/failures/history.hpp"
#include "tests/link/failures/network.hpp"
#include "tests/link/failures/plan.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::failures {

// The program of that name, of those that are tested.
[[nodiscard]] std::string program(const char* name);
[[nodiscard]] std::string own_program();

class FailingHost {
 public:
  // `runtime` is shared by all; `directory` is for recordings and logs.
  FailingHost(const Plan& plan, unsigned number, const std::string& runtime, std::string directory);

  [[nodiscard]] unsigned number() const { return number_; }
  [[nodiscard]] HostNetwork& network() { return network_; }
  [[nodiscard]] std::string name() const { return instance_of(number_); }

  void start_link();
  void start_component();
  void kill_link();
  void kill_component() { component_.kill(); }
  [[nodiscard]] test::ChildProcess& link() { return link_; }
  [[nodiscard]] test::ChildProcess& component() { return component_; }
  [[nodiscard]] test::Daemon& daemon() { return daemon_; }
  // Somebody else kills it from now on; kill_link() before the next start.
  void expect_death_of_link() { without_link_.push_back({now(), 0}); }
  [[nodiscard]] bool has_rival() const { return rival_.runs(); }
  void start_rival();
  void end_rival(bool abruptly);

  [[nodiscard]] std::vector<Import> imports();  // by the other's number - 1; its own is empty
  // What there is to tell of it at the end.
  [[nodiscard]] HostHistory history();
  // The processes of which the delays count.
  [[nodiscard]] std::vector<pid_t> pids() const;

  // Ends all but the daemon, in order; adds what did not end well.
  void end(Findings& found);
  [[nodiscard]] std::string recording() const { return directory_ + "/" + name() + ".mcap"; }
  // Lines that the component has written of what it must not see.
  void add_seen_by_component(Findings& found) const;

 private:
  static test::Daemon::Options daemon_options(const Plan& plan, unsigned number,
                                              const std::string& runtime,
                                              const std::string& directory);
  test::ChildProcess start(std::vector<std::string> command, const std::string& log) const;
  test::ChildProcess start_component(std::uint32_t life, bool is_rival) const;

  const Plan& plan_;
  const unsigned number_;
  const std::string directory_;
  HostNetwork network_;
  test::Daemon daemon_;
  test::ChildProcess recorder_;
  test::ChildProcess link_;
  test::ChildProcess component_;
  test::ChildProcess rival_;
  std::vector<test::ChildProcess> former_rivals_;  // were told to end
  std::vector<Nanoseconds> lives_;
  Nanoseconds link_since_ = 0;
  std::vector<Span> without_link_;
  std::vector<RivalLife> rivals_;
};

}  // namespace arbiter::failures
