// The demo, told to keep its things in a directory of the test's, and what it leaves there.
#pragma once

#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "shm/file_descriptor.hpp"
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
    for (const auto& [pid, program] : own()) programs.push_back(program);
    std::sort(programs.begin(), programs.end());
    return programs;
  }

  // The kernel takes its time to end those whose parent was killed: ten seconds for each at most.
  [[nodiscard]] std::vector<std::string> processes_after_a_while() const {
    for (const auto& [pid, program] : own()) {
      const shm::FileDescriptor process(static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)));
      pollfd ended{process.get(), POLLIN, 0};
      if (process) ::poll(&ended, 1, 10'000);
    }
    return processes();
  }

  [[nodiscard]] std::vector<std::pair<pid_t, std::string>> own() const {
    std::vector<std::pair<pid_t, std::string>> found;
    std::error_code gone;
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
      std::ifstream file(entry.path() / "environ", std::ios::binary);
      const std::string environment{std::istreambuf_iterator<char>(file), {}};
      if (environment.find(directory_.path()) == std::string::npos) continue;
      const auto program = std::filesystem::read_symlink(entry.path() / "exe", gone);
      if (!gone) found.emplace_back(std::stoi(entry.path().filename()), program.filename());
    }
    return found;
  }

 private:
  TemporaryDirectory directory_;
};

}  // namespace arbiter::test
