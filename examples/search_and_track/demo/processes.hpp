// The daemon and the components: started in a runtime directory of their own, heard, and stopped.
//
// Nothing is left behind. Whoever ends this object ends them and waits for them; should this
// process be killed, the kernel kills them (PR_SET_PDEATHSIG). They are in process groups of their
// own, so that a Ctrl-C reaches this process alone, which then ends them in good order.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace search_and_track {

// A directory that is there for as long as this object is.
class TemporaryDirectory {
 public:
  TemporaryDirectory();
  ~TemporaryDirectory();
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

class Processes {
 public:
  // Sets the environment in which they will find each other.
  Processes();
  ~Processes();
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;

  // Starts the daemon and returns when it answers. Throws if it does not.
  void start_daemon(const std::filesystem::path& program, const std::filesystem::path& model);
  // Returns the number by which listen() calls it. Throws if it cannot be started.
  std::size_t start_component(const std::filesystem::path& program,
                              const std::vector<std::string>& arguments);

  using OnLine = std::function<void(std::size_t component, std::string_view line)>;
  // Waits until a component says something, `wakeup` is readable or the time is over; hands out
  // the lines that have come.
  void listen(int wakeup, int timeout_ms, const OnLine& on_line);
  // Throws if one has ended that should be running.
  void check_all_run();

 private:
  struct Child {
    std::string name;
    pid_t pid = -1;
    int output = -1;  // what it prints; -1: the log has it
    std::string unfinished_line;
  };

  Child spawn(const std::filesystem::path& program, const std::vector<std::string>& arguments,
              bool heard);
  static void stop(std::vector<Child>& children) noexcept;
  [[nodiscard]] std::string log() const;

  TemporaryDirectory directory_;
  std::vector<Child> daemon_;  // one, once it has been started
  std::vector<Child> components_;
};

}  // namespace search_and_track
