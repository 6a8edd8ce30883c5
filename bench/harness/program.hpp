// A program that runs beside the workers: a daemon.
#pragma once

#include <sys/types.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace arbiter::bench {

class Program {
 public:
  Program() = default;
  // Starts it with these variables set; what it prints goes to `log`. It ends with the benchmark.
  Program(const std::vector<std::string>& argv, const std::map<std::string, std::string>& variables,
          const std::string& log);
  Program(Program&& other) noexcept;
  Program& operator=(Program&& other) noexcept;
  // Asks it to end (SIGTERM), and waits until it has.
  ~Program();

  [[nodiscard]] pid_t pid() const { return pid_; }
  void signal(int number) const;

 private:
  void end() noexcept;

  pid_t pid_ = -1;
};

// A directory that goes with its object.
class ScratchDirectory {
 public:
  ScratchDirectory();
  ScratchDirectory(const ScratchDirectory&) = delete;
  ScratchDirectory& operator=(const ScratchDirectory&) = delete;
  ~ScratchDirectory();

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// Runs `work` in a process of its own, whose temporary directory goes with it, and returns its exit
// code. All that it starts has ended when this returns, and nothing of it is left in the file
// system: also where it was killed, or Ctrl-C was pressed.
int run_and_clear_up(const std::function<int()>& work);

// Where the benchmark's own program lies, and so the other programs too.
std::string program_directory();

}  // namespace arbiter::bench
