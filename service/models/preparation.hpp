// The jobs of a compiler: what is read, proved and compared before the loop puts it in force.
#pragma once

#include <chrono>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "rules/prove/budget.hpp"
#include "service/models/compiler.hpp"

namespace arbiter::service {

// Reads the policy and all models. In any thread; throws rules::Stopped, std::runtime_error.
[[nodiscard]] Reading read_files(const std::vector<NamedFiles>& files, const Gate& gate,
                                 const Proving& proving, const std::stop_token& stop);

// The model of that name, or the first; null where there is none.
[[nodiscard]] ModelPointer find_model(const std::vector<ModelPointer>& models,
                                      const std::string& name);

// What the one decides differently from the other: as Reading::changes. It may fail to find that
// out, and then says so; it throws rules::Stopped only.
[[nodiscard]] std::string changes_between(const Model& before, const Model& after,
                                          std::uint64_t steps, const std::stop_token& stop);

// Says how far a model is: to the service manager once a second, with the request to wait; or, if
// none listens, in the log every two seconds. Of what takes less it says nothing. At the end the
// manager is shown the instance again. To be used in the compiler's thread: a manager that does not
// read holds up the thread that writes to it.
class StatusLine {
 public:
  using Clock = std::chrono::steady_clock;

  explicit StatusLine(std::string instance, std::function<Clock::time_point()> now = Clock::now);
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;
  ~StatusLine();

  // Must not outlive this.
  [[nodiscard]] rules::Budget::Watch watch();

 private:
  const std::string instance_;
  const std::function<Clock::time_point()> now_;
  const bool has_manager_;
  Clock::time_point next_;
  bool has_told_ = false;
};

}  // namespace arbiter::service
