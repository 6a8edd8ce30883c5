// The demo, told to keep its things in a directory of the test's, and what it leaves there.
#pragma once

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {

class Demo {
 public:
  // The command line that runs it.
  [[nodiscard]] std::vector<std::string> command(const std::vector<std::string>& arguments,
                                                 const std::string& environment = "LANG=C") const {
    std::vector<std::string> argv{"/usr/bin/env", "TMPDIR=" + directory_.path(), environment,
                                  ARBITER_PROGRAMS "/search-and-track-demo"};
    argv.insert(argv.end(), arguments.begin(), arguments.end());
    return argv;
  }

  [[nodiscard]] std::vector<std::string> files_left() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(directory_.path())) {
      names.push_back(entry.path().filename());
    }
    return names;
  }

  // The processes that have the test's directory in their environment: the demo and its children.
  [[nodiscard]] std::vector<std::string> processes() const {
    std::vector<std::string> programs;
    std::error_code gone;
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
      std::ifstream file(entry.path() / "environ", std::ios::binary);
      const std::string environment{std::istreambuf_iterator<char>(file), {}};
      if (environment.find(directory_.path()) == std::string::npos) continue;
      const auto program = std::filesystem::read_symlink(entry.path() / "exe", gone);
      if (!gone) programs.push_back(program.filename());
    }
    std::sort(programs.begin(), programs.end());
    return programs;
  }

  // The kernel takes its time to end those whose parent was killed.
  [[nodiscard]] std::vector<std::string> processes_after_a_while() const {
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (!processes().empty() && std::chrono::steady_clock::now() < give_up) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return processes();
  }

 private:
  TemporaryDirectory directory_;
};

}  // namespace arbiter::test
