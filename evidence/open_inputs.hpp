// Which input ports are open, at times that do not fall. When a port was opened or closed, the
// recording knows by when the daemon said so.
#pragma once

#include <cstddef>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "evidence/records.hpp"

namespace arbiter::evidence {

class OpenInputs {
 public:
  // Keeps the reference.
  explicit OpenInputs(const std::vector<PortChange>& changes) : changes_(changes) {}

  bool has(Nanoseconds time, const std::string& port) {
    for (; next_ < changes_.size() && changes_[next_].seen <= time; ++next_) {
      const PortChange& change = changes_[next_];
      using What = PortChange::What;
      if (change.what == What::open || change.what == What::opened) {
        open_.insert(change.port);
      } else {
        open_.erase(change.port);
      }
    }
    return open_.contains(port);
  }

 private:
  const std::vector<PortChange>& changes_;
  std::size_t next_ = 0;
  std::set<std::string, std::less<>> open_;
};

}  // namespace arbiter::evidence
