// What taps tell of arrivals: until a picture has come after them, and of the samples among them
// for as long as they can wait in a queue.
//
// The times are the publishers' word, and are judged before anything counts on them.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "top/frame.hpp"

namespace arbiter::top {

class Arrivals {
 public:
  // No picture may come for long, where sources change too fast for one: then the latest stay.
  static constexpr std::size_t kMostNew = 100'000;

  // By time. `now`: after all of them. Left out is what lies behind it or before 0, and of a
  // queue's samples what lies before the last one.
  void add(std::vector<Accepted> accepted, shm::Nanoseconds now);

  [[nodiscard]] const std::vector<Accepted>& fresh() const { return fresh_; }
  // A picture of that time has come.
  void drop_until(shm::Nanoseconds time);

  // Of the samples in the port's queues when the census was taken: how long at most the oldest had
  // waited. 0: none waited; nothing: it arrived before its port was tapped.
  [[nodiscard]] std::optional<shm::Nanoseconds> oldest_at(const PortFact& port,
                                                          const Census& census) const;

 private:
  void note_sample(const Accepted& accepted);

  std::vector<Accepted> fresh_;  // that no picture has come after yet
  // Of samples, by port and source, ascending: as many as can wait.
  std::map<std::pair<std::string, std::string>, std::deque<shm::Nanoseconds>> samples_;
};

}  // namespace arbiter::top
