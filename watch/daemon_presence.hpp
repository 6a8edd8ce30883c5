// Whether an instance has a daemon, as what has changed since somebody looked.
#pragma once

#include <cstdint>
#include <utility>

#include "watch/instance.hpp"

namespace arbiter::watch {

class DaemonPresence {
 public:
  struct Change {
    bool has_gone = false;
    bool is_back = false;  // with `has_gone`: one was followed by another between two looks
  };
  Change look(const Instance& instance) {
    const std::uint64_t daemons = instance.daemons();
    const bool is_another = daemons != std::exchange(daemons_, daemons) && daemons > 1;
    const bool is_alone = !instance.has_daemon();
    const bool was_alone = std::exchange(is_alone_, is_alone);
    return {!was_alone && (is_alone || is_another), !is_alone && (was_alone || is_another)};
  }

 private:
  std::uint64_t daemons_ = 0;
  bool is_alone_ = false;
};

}  // namespace arbiter::watch
