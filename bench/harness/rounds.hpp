// Interleaved rounds: each contender is measured for a moment, then the next, and again from the
// start, so that what the machine does meanwhile befalls all of them alike.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bench/harness/report.hpp"

namespace arbiter::bench {

struct Contender {
  std::string system;
  Role role = Role::kOurs;
  // Measures for about so long. May throw; then the contender is out, and the report says why.
  std::function<Histogram(double seconds)> round;
};

struct Budget {
  int rounds = 10;
  double seconds_each = 0.1;
};

// What is measured now.
struct Round {
  int number = 0, of = 0;  // of those that count; 0: the warm-up
  std::string system;
};
// Called before each contender's turn, in the thread that measures, until it is replaced.
void watch_rounds(std::function<void(const Round&)> watch);

// The first round is a warm-up and does not count.
std::vector<Result> run_rounds(std::vector<Contender> contenders, const Budget& budget);

// A contender that could not even be set up.
Result absent(const std::string& system, Role role, const std::string& why);

}  // namespace arbiter::bench
