// The cases: each is a scenario, and the limits within which it is explored. cases_test runs them
// as they are; weaken_each runs them with one order of the sources left out after the other.
#pragma once

#include <functional>
#include <ostream>
#include <utility>
#include <vector>

#include "tests/explore/explorer.hpp"

namespace arbiter::explore {

using Explore = std::function<void(const Explorer::Scenario&)>;

struct Case {
  const char* name;
  Limits limits;
  // Makes what the scenario needs, and calls the function once, with the scenario.
  std::function<void(const Explore&)> body;
};

// What GoogleTest lists it by.
inline void PrintTo(const Case& each, std::ostream* to) { *to << each.name; }

inline std::vector<Case>& cases() {
  static std::vector<Case> all;
  return all;
}

struct Register {
  Register(const char* name, Limits limits, std::function<void(const Explore&)> body) {
    cases().push_back({name, limits, std::move(body)});
  }
};

}  // namespace arbiter::explore
