// Which ports are open, as a daemon tells it from time to time: what has changed becomes records.
//
// Thread safety: none of its own.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "recorder/record_queue.hpp"
#include "wire/status.hpp"

namespace arbiter::recorder {

class OpenPorts {
 public:
  // Who died before `now` is not told of.
  explicit OpenPorts(Nanoseconds now) : last_death_(now) {}

  // Adds what has changed, as of `now`, since the last time; the first time, what there is.
  void note(const wire::Status& status, Nanoseconds now, Batch& batch);
  // Whether a daemon has told it once.
  [[nodiscard]] bool is_known() const noexcept { return is_known_; }

 private:
  using Ports = std::map<std::pair<bool, std::string>, evidence::PortChange>;

  [[nodiscard]] Ports ports_of(const wire::Status& status) const;
  void note_deaths(const std::vector<wire::DeathStatus>& deaths, Batch& batch);

  Ports ports_;
  bool is_known_ = false;
  Nanoseconds last_death_;
};

}  // namespace arbiter::recorder
