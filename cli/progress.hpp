// Says on standard error how far a long run is, for who waits before it.
//
// On a terminal one line, which comes when a run takes a moment, changes with it, and is gone at
// the end. Elsewhere a line after two seconds, and then one every ten, so that a log shows what
// took so long. Standard output stays as it is.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <ostream>
#include <string>

#include "rules/prove/budget.hpp"

namespace arbiter::cli {

class ProgressLine {
 public:
  using Clock = std::chrono::steady_clock;

  // On standard error.
  ProgressLine();
  ProgressLine(std::ostream& out, bool is_terminal, std::function<Clock::time_point()> now);
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  ~ProgressLine() { clear(); }

  // Must not outlive this.
  rules::Budget::Watch watch();
  // Must not outlive this: "STAGE: 42 %".
  std::function<void(std::uint64_t done, std::uint64_t all)> watch(std::string stage);
  // Shows the line if it is time for it; to be called often. `text` is called only then.
  void show(const std::function<std::string()>& text);
  // Since this was made.
  [[nodiscard]] std::chrono::seconds elapsed() const {
    return std::chrono::duration_cast<std::chrono::seconds>(now_() - start_);
  }
  // Before anything else is written there.
  void clear();

 private:
  std::ostream& out_;
  const bool is_terminal_;
  const std::function<Clock::time_point()> now_;
  const Clock::time_point start_;
  Clock::time_point next_;
  bool is_shown_ = false;
};

}  // namespace arbiter::cli
