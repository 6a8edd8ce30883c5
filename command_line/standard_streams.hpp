// The three standard streams of a program that was started without some of them.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <initializer_list>

namespace arbiter::command_line {

// The first that main() calls. A stream that is closed leads nowhere from then on: otherwise its
// number would go to the next file or socket that is opened, and what is said would be written
// there. False: there is not even /dev/null.
[[nodiscard]] inline bool open_standard_streams() noexcept {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    // The lowest number that is free.
    if (::fcntl(stream, F_GETFD) == -1 && ::open("/dev/null", O_RDWR) != stream) return false;
  }
  return true;
}

}  // namespace arbiter::command_line
