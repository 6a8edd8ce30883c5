// What arbiter echo says of the daemon and of its models while it watches a port.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "cli/live.hpp"
#include "shm/decision_memory.hpp"
#include "watch/instance.hpp"

namespace arbiter::cli {

// On standard error: that the daemon has gone, that one is there again, and that a model has come
// into force that does not mention the port. Silent where the policy does not let us observe.
class EchoNews {
 public:
  // `instance`: null where it cannot be observed.
  EchoNews(std::shared_ptr<watch::Instance> instance, std::string port);
  // To be called several times a second. Asks the daemon for its names once for each model, for a
  // second at most.
  void tell();

 private:
  void tell_of_model();
  [[nodiscard]] bool is_mentioned(const shm::DecisionMemory& memory) const;

  const std::shared_ptr<watch::Instance> instance_;
  const std::string port_;
  DaemonNews daemon_{"watching"};
  ModelNews models_;
};

// Null: the policy does not let us observe, or there is no daemon.
[[nodiscard]] std::shared_ptr<watch::Instance> observe_for_echo(const std::string& instance);

}  // namespace arbiter::cli
