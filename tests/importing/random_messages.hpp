// When and from whom messages come, at random: often at one moment, or when something is just not,
// or just, as old as its timeout.
#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "shm/activity.hpp"

namespace arbiter::test {

class Random {
 public:
  explicit Random(unsigned seed) : random_(seed) {}

  // From 0 on.
  int pick(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }

  template <typename T>
  const T& any_of(const std::vector<T>& values) {
    return values[static_cast<std::size_t>(pick(static_cast<int>(values.size())))];
  }

  template <typename T>
  std::vector<T> shuffled(std::vector<T> values) {
    std::shuffle(values.begin(), values.end(), random_);
    return values;
  }

  // `ends`: when what came before is as old as its timeout.
  shm::Nanoseconds next_time(shm::Nanoseconds now, const std::vector<shm::Nanoseconds>& ends) {
    if (pick(4) == 0) return now;
    if (pick(2) == 0) return now + pick(300) * 1'000'000;
    std::vector<shm::Nanoseconds> times{now + 1};
    for (const shm::Nanoseconds end : ends) {
      for (const shm::Nanoseconds time : {end - 1, end, end + 1, end + 2}) {
        if (time >= now) times.push_back(time);
      }
    }
    return any_of(times);
  }

 private:
  std::mt19937 random_;
};

}  // namespace arbiter::test
