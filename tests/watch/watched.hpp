// An instance that a test watches.
#pragma once

#include <poll.h>

#include <functional>
#include <memory>
#include <string>

#include "tests/support/daemon.hpp"
#include "watch/instance.hpp"

namespace arbiter::test {

inline wire::Caller caller_of(const Daemon& daemon) {
  wire::Caller caller;
  caller.name = "test-watch";
  caller.instance = daemon.instance();
  return caller;
}

inline std::shared_ptr<watch::Instance> watched(const Daemon& daemon) {
  return std::make_shared<watch::Instance>(caller_of(daemon));
}

// For a caller who gives the daemon little time: on a busy machine it may need more at first.
inline std::shared_ptr<watch::Instance> watched_by(const wire::Caller& caller) {
  for (;;) {
    try {
      return std::make_shared<watch::Instance>(caller);
    } catch (const wire::RefusedError&) {
      throw;
    } catch (const wire::CallError&) {  // it did not answer in time
    }
  }
}

// Takes up what comes until it is so.
inline void update_until(watch::Instance& instance, const std::function<bool()>& is_so) {
  while (!is_so()) {
    pollfd readable{instance.descriptor(), POLLIN, 0};
    ::poll(&readable, 1, -1);
    instance.update();
  }
}

}  // namespace arbiter::test
