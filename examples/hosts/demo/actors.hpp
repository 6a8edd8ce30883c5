// The processes of the demo. One that dies is started again a little later, as a service manager
// would. All of them end with this process, however it ends.
#pragma once

#include <sys/types.h>

#include <array>
#include <chrono>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "cast.hpp"
#include "processes.hpp"

namespace hosts_demo {

class Actors {
 public:
  using Clock = std::chrono::steady_clock;

  explicit Actors(std::array<std::vector<std::string>, kParts.size()> commands);
  ~Actors();
  Actors(const Actors&) = delete;
  Actors& operator=(const Actors&) = delete;

  using OnLine = std::function<void(std::size_t part, std::string_view line)>;
  // Hands out what they say until `wakeup` is readable or the time is over; starts those again that
  // have been dead for `pause`.
  void listen(int wakeup, int timeout_ms, std::chrono::milliseconds pause, const OnLine& on_line);

  // -1: it is dead.
  [[nodiscard]] pid_t pid(std::size_t part) const { return children_[part].pid; }
  // To one that lives; SIGKILL is its death, after which it is started again.
  void signal(std::size_t part, int number) const;
  // Not before this is called again with false.
  void keep_dead(std::size_t part, bool is_kept) { children_[part].stays_dead = is_kept; }

 private:
  struct Child {
    std::vector<std::string> command;
    pid_t pid = -1;
    int output = -1;
    bool stays_dead = false;
    Clock::time_point died{};
    std::string unfinished_line;
  };
  void start(Child& child, std::size_t part) const;
  static void note_end(Child& child);
  void read_from(std::size_t part, const OnLine& on_line);

  search_and_track::TemporaryDirectory directory_;
  std::array<Child, kParts.size()> children_;
};

}  // namespace hosts_demo
