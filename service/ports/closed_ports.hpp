// What is left of ports that have closed and of names that nobody needs, until it is unmapped and
// its descriptors are given up.
//
// For the kernel that is the costly part of it, and nobody waits for it: it is done in turns of the
// loop, so that a component that had thousands of ports holds up nobody. What it counted is its
// user's again at once.
#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <utility>

#include "shm/activity.hpp"
#include "shm/clock.hpp"

namespace arbiter::service {

class ClosedPorts {
 public:
  void add(std::shared_ptr<void> left) {
    left_.push_back(std::move(left));
    if (left_.size() > kMost) left_.pop_front();
  }
  // Gives up one at least, if there is one, and no more after `until`.
  void give_up(shm::Nanoseconds until) {
    while (!left_.empty()) {
      left_.pop_front();
      if (shm::monotonic_now() >= until) return;
    }
  }
  // Before a port is opened: gives up as much as it takes and more, so that whoever opens and
  // closes ports again and again never makes this grow beyond what was open at once.
  void make_room() {
    for (std::size_t i = 0; i < kForAPort && !left_.empty(); ++i) left_.pop_front();
  }
  [[nodiscard]] bool empty() const { return left_.empty(); }

 private:
  static constexpr std::size_t kMost = 16384;  // whoever leaves more pays at once
  static constexpr std::size_t kForAPort = 4;  // it leaves itself, and perhaps a page

  std::deque<std::shared_ptr<void>> left_;
};

}  // namespace arbiter::service
