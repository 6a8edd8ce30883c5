// Taps of input ports, which tell each arrival that was accepted: so that no winner is missed, not
// even one that comes and goes between two looks.
//
// To open a tap takes a component's time and memory, and its publishers some 210 instructions for
// each arrival from then on (arbiter/tap.hpp). So a port is tapped only if it was asked for.
#pragma once

#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "top/frame.hpp"

namespace arbiter::top {

// Thread safety: belongs to one thread. Taps are opened on another, for that may take its time;
// once open, they are read here, which is wait-free.
class Tapper {
 public:
  explicit Tapper(std::string instance) : instance_(std::move(instance)) {}
  Tapper(const Tapper&) = delete;
  Tapper& operator=(const Tapper&) = delete;
  // Waits for a tap that is being opened: a second at most, where no daemon answers.
  ~Tapper();

  // Which ports are to be tapped from now on. One that was refused is forgotten, and tried again if
  // it is among them the next time.
  void watch(const std::set<std::string>& ports);
  // Which were refused since the last time; problem() says why.
  [[nodiscard]] std::vector<std::string> take_refused();
  // What the taps have told since the last time, by time.
  std::vector<Accepted> collect();
  // The ports that are tapped, and how long what was taken there during the last ten seconds had
  // waited; nothing: nothing was taken. Once for each frame.
  [[nodiscard]] std::map<std::string, std::optional<Waits>> tapped(shm::Nanoseconds now);
  // Of the port that was asked for last, why it is not tapped; or how much was lost; else "".
  [[nodiscard]] std::string problem() const { return problem_; }

 private:
  void run(const std::stop_token& stop);
  void take_up_opened();

  struct Tapped {
    Tap<> tap;
    std::deque<std::pair<shm::Nanoseconds, Latencies>> counted{};  // a second apart, ten of them
  };

  const std::string instance_;
  std::set<std::string> wanted_;
  std::map<std::string, Tapped> taps_;
  std::string problem_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable_any asked_;
  std::vector<std::string> to_open_;
  std::vector<std::pair<std::string, Tap<>>> opened_;
  std::vector<std::pair<std::string, std::string>> refused_;  // and why
  std::jthread thread_;  // from the first question on; last: it uses all of these
};

}  // namespace arbiter::top
