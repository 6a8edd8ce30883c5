// A component that waits for no daemon.
#pragma once

#include <chrono>
#include <string>

#include <arbiter/arbiter.hpp>

namespace arbiter::test {

inline NodeOptions impatient() {
  NodeOptions options;
  options.connect_timeout = std::chrono::milliseconds(1);
  options.on_waiting = [](const std::string&) {};
  return options;
}

}  // namespace arbiter::test
