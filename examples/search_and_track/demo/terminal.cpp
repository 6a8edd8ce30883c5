#include "terminal.hpp"

#include <signal.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>

namespace search_and_track {

bool Terminal::is_there() {
  const char* const kind = std::getenv("TERM");
  return isatty(STDOUT_FILENO) == 1 && kind != nullptr && std::string_view(kind) != "dumb";
}

Terminal::Terminal() {
  const char* const no_color = std::getenv("NO_COLOR");
  coloured_ = no_color == nullptr || *no_color == '\0';
  signal(SIGTSTP, SIG_IGN);               // whoever stopped us would find himself on our screen
  write("\x1b[?1049h\x1b[?25l\x1b[?7l");  // our screen, no cursor, no wrapping
}

Terminal::~Terminal() {
  write("\x1b[0m\x1b[?7h\x1b[?25h\x1b[?1049l");
  signal(SIGTSTP, SIG_DFL);
}

Terminal::Size Terminal::size() {
  winsize window{};
  Size now{24, 80};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) == 0 && window.ws_row > 0 && window.ws_col > 0) {
    now = {window.ws_row, window.ws_col};
  }
  if (now != last_) write("\x1b[0m\x1b[2J");
  last_ = now;
  return now;
}

void Terminal::write(std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(STDOUT_FILENO, text.data(), text.size());
    if (count < 0 && errno != EINTR) return;
    if (count > 0) text.remove_prefix(static_cast<std::size_t>(count));
  }
}

}  // namespace search_and_track
