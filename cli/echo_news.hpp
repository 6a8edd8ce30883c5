// What arbiter echo says of the daemon and of its models while it watches a port.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "cli/live.hpp"
#include "shm/decision_memory.hpp"
#include "shm/file_descriptor.hpp"
#include "watch/instance.hpp"

namespace arbiter::cli {

// On standard error: that the daemon has gone, that one is there again, and that a model has come
// into force that does not mention the port. Silent where the policy does not let us observe.
class EchoNews {
 public:
  // Waits some seconds for a daemon that is there and does not answer yet; less if it is
  // interrupted. Throws wire::CallError where none answers.
  EchoNews(const std::string& instance, std::string port, const shm::FileDescriptor& interrupts);
  // To be called several times a second. Asks the daemon for its names once for each model, for a
  // second at most.
  void tell();
  // Null: the policy does not let us observe.
  [[nodiscard]] watch::Instance* instance() noexcept { return instance_.get(); }

 private:
  void tell_of_model();
  [[nodiscard]] bool is_mentioned(const shm::DecisionMemory& memory) const;

  std::shared_ptr<watch::Instance> instance_;
  const std::string port_;
  DaemonNews daemon_{"watching"};
  ModelNews models_;
};

}  // namespace arbiter::cli
