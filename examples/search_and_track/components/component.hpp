// What the components of this example share: a simulated world, and a word on standard output
// whenever something changes. Nothing here is needed to use Arbiter.
#pragma once

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>

#include <arbiter/arbiter.hpp>

namespace search_and_track {

// Stands in for the camera and the skin: says when there is something to detect.
//   --active FROM-TO   there is from FROM to TO, in seconds; without it, always
//   --start NS         seconds count from then (steady clock); without it, from now
class World {
 public:
  World(int argc, char** argv) {
    for (int i = 1; i < argc; i += 2) {
      const std::string_view option = argv[i];
      const std::string value = i + 1 < argc ? argv[i + 1] : "";
      const std::size_t dash = value.find('-');
      try {
        if (option == "--active" && dash != std::string::npos) {
          from_ = std::stod(value.substr(0, dash));
          to_ = std::stod(value.substr(dash + 1));
          continue;
        }
        if (option == "--start") {
          start_ = Clock::time_point(std::chrono::nanoseconds(std::stoll(value)));
          continue;
        }
      } catch (const std::logic_error&) {  // not a number
      }
      throw std::invalid_argument("usage: " + std::string(argv[0]) +
                                  " [--active FROM-TO] [--start NS]");
    }
  }

  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(Clock::now() - start_).count();
  }
  [[nodiscard]] bool has_something() const {
    const double now = seconds();
    return now >= from_ && now < to_;
  }
  // Until the next look. Ten looks fit into the time for which a sample keeps its source active.
  static void wait() { std::this_thread::sleep_for(std::chrono::milliseconds(50)); }

 private:
  using Clock = std::chrono::steady_clock;

  Clock::time_point start_ = Clock::now();
  double from_ = 0;
  double to_ = 1e9;
};

// Prints a line when it differs from the one before.
class Report {
 public:
  void sent(const arbiter::Outcome& outcome) {
    say("delivered " + std::to_string(outcome.delivered) + " discarded " +
        std::to_string(outcome.discarded));
  }
  void silent() { say("silent"); }

 private:
  void say(const std::string& line) {
    if (line == last_) return;
    std::cout << line << std::endl;
    last_ = line;
  }

  std::string last_;
};

inline int fail(const char* program, const std::exception& error) {
  std::cerr << program << ": " << error.what() << '\n';
  return 1;
}

}  // namespace search_and_track
