// A component that does not wait long for a daemon.
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

// Does what must come to pass at last: who is impatient may have to try more than once where the
// machine is busy.
template <class Try>
auto at_last(const Try& try_it) {
  for (;;) {
    try {
      return try_it();
    } catch (const Error&) {
    }
  }
}

inline Node impatient_node(const std::string& name) {
  return at_last([&] { return Node(name, impatient()); });
}

}  // namespace arbiter::test
