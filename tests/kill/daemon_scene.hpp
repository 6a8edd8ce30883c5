// What surrounds a daemon that kills itself: components with ports, one that asks something of it,
// and what must still be so under its successor.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {

class DaemonScene {
 public:
  struct Options {
    bool stores = false;        // the service manager keeps descriptors
    bool by_stranger = false;   // the one that asks is another user's
    bool yields = false;        // a survivor has /fresh:o, and yields it
    bool has_survivors = true;  // components are there when the daemon is told to die
  };
  explicit DaemonScene(const Options& options);

  // From now on: at that passing of that step.
  void die_at(const std::string& step, unsigned passing);
  void live_on() { files_.write("die-at", ""); }

  // Each is asked of a daemon that may die of it. False: it has; then the same is asked of the
  // successor, or goes on there.
  bool start();
  bool take_over();
  bool stop();
  bool reload();
  // Lines to the component that asks, one after the other (tests/client/component_main.cpp).
  bool ask(const std::vector<std::string>& lines);

  // Samples go on without a daemon.
  void require_flow();
  // A successor, and everything that must be so under it.
  void require_all_is_well();
  [[nodiscard]] std::string log() const { return daemon_.log(); }

 private:
  void open_survivors();
  // The daemon serves, and has done all that was asked.
  bool lives();
  void restart();
  void finish_asking();
  [[nodiscard]] bool is_refused_for_now(const std::string& answer) const;
  void require_model_in_force();
  void require_one_writer();
  void require_accounts_balance();
  void require_another_round();
  bool has_died();

  const Options options_;
  TemporaryDirectory files_;
  ScopedVariable die_at_;
  Daemon daemon_;
  std::string in_force_ = "a";  // whose samples the model lets through, once it is in force
  std::int64_t next_ = 0;
  std::optional<OutputPort<Number>> yielding_;  // until the node's thread closes it
  std::optional<Node> node_;
  std::map<std::string, OutputPort<Number>> outputs_;
  std::optional<OutputPort<Number>> side_;  // what a new input port is connected to
  std::optional<InputPort<Number>> in_;
  std::optional<InputPort<Number>> fresh_;
  std::optional<Component> asking_;
  std::vector<std::string> unanswered_;
  std::map<std::string, bool> asked_for_;  // ports by name; true: it is open
};

}  // namespace arbiter::test
