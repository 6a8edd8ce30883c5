// This host's part when all hosts switch to another model (docs/hosts.md, "Switching everywhere"):
// it is asked to prepare, and then to commit or to release.
//
// To prepare, it asks its daemon whether it would switch, and promises to do so for two seconds.
// The daemon knows nothing of a promise: it goes on deciding, and anybody who may switches it
// meanwhile.
//
// Thread safety: none of its own; it is the desk's.
#pragma once

#include <chrono>
#include <functional>
#include <stdexcept>
#include <string>

#include "link/answers.hpp"
#include "link/core/promise.hpp"
#include "shm/activity.hpp"
#include "wire/switch_request.hpp"

namespace arbiter::link {

// It was asked, and has not answered: nobody knows whether it has switched.
class NoAnswer : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Asks a daemon to switch or, with `is_dry_run`, whether it would. What it throws is why not.
using SwitchTo = std::function<wire::SwitchAnswer(const std::string& model, bool is_dry_run)>;
// The daemon of that instance, as this process's user; waits for a second at most.
[[nodiscard]] SwitchTo switch_of_daemon(const std::string& instance);

class Switching {
 public:
  using Clock = std::function<shm::Nanoseconds()>;

  Switching(std::string host, SwitchTo switch_to, Clock clock)
      : host_(std::move(host)), switch_to_(std::move(switch_to)), clock_(std::move(clock)) {}

  // Must outlive them.
  void add_to(Answers& answers);

  [[nodiscard]] Answer prepare(const Question& question);
  [[nodiscard]] Answer commit(const Question& question);
  [[nodiscard]] Answer release(const Question& question);

 private:
  [[nodiscard]] bool is_left_out(const wire::SwitchRequest& request) const;

  const std::string host_;
  const SwitchTo switch_to_;
  const Clock clock_;
  Promise promise_;
};

}  // namespace arbiter::link
