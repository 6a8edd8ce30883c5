// One host of a round: a network, a daemon, a link, a component, and a recorder, which is no part
// of what is troubled.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/link/failures/checker.hpp"
#include "tests/link/failures/network.hpp"
#include "tests/link/failures/plan.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::failures {

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
  // From each kill of its link to the next start, and its first life's beginning.
  [[nodiscard]] const std::vector<Span>& without_link() const { return without_link_; }
  [[nodiscard]] Nanoseconds link_since() const { return link_since_; }

  // What the status says of what it gets from another: "published" and "described".
  struct Import {
    std::uint64_t published = 0;
    std::string described;
    bool operator==(const Import&) const = default;
  };
  [[nodiscard]] std::vector<Import> imports();  // by the other's number - 1; its own is empty

  // Ends all but the daemon, in order; adds what did not end well.
  void end(Findings& found);
  [[nodiscard]] std::string recording() const { return directory_ + "/" + name() + ".mcap"; }
  // Lines that the component has written of what it must not see.
  void add_seen_by_component(Findings& found) const;

 private:
  test::ChildProcess start(std::vector<std::string> command, const std::string& log) const;

  const Plan& plan_;
  const unsigned number_;
  const std::string directory_;
  HostNetwork network_;
  test::Daemon daemon_;
  test::ChildProcess recorder_;
  test::ChildProcess link_;
  test::ChildProcess component_;
  std::uint32_t life_ = 0;
  Nanoseconds link_since_ = 0;
  std::vector<Span> without_link_;
};

// Of "host head, 3 lost, 2 late, …": all that has not arrived.
[[nodiscard]] std::uint64_t counted_in(const std::string& described);

}  // namespace arbiter::failures
