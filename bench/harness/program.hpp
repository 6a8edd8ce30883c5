// A program that runs beside the workers: a daemon.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace arbiter::bench {

class Program {
 public:
  // Changes to the environment that it is started in; nullopt: not set.
  using Variables = std::map<std::string, std::optional<std::string>>;

  Program() = default;
  // What it prints goes to `log`, at its end. It ends with the benchmark.
  Program(const std::vector<std::string>& argv, const Variables& variables, const std::string& log);
  Program(Program&& other) noexcept;
  Program& operator=(Program&& other) noexcept;
  // Asks it to end (SIGTERM), and waits until it has.
  ~Program();

  [[nodiscard]] pid_t pid() const { return pid_; }
  // Those that it has started, and still run.
  [[nodiscard]] std::vector<pid_t> children() const;
  void signal(int number) const;
  // False: it has not ended by then.
  [[nodiscard]] bool ends_within(std::chrono::milliseconds limit);
  // Of one that has ended; 128 and the signal's number if a signal ended it.
  [[nodiscard]] int exit_code() const { return exit_code_; }

 private:
  void end() noexcept;

  pid_t pid_ = -1;
  int exit_code_ = -1;
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
