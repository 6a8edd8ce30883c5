// What the terminal and the locale say of themselves. Apart from the screen, for <term.h> defines
// macros of names that everybody uses.
#define NCURSES_NOMACROS 1
#include <langinfo.h>
#include <ncurses.h>
#include <term.h>
#include <unistd.h>
#undef columns
#undef lines

#include <clocale>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>

#include "top/screen.hpp"

namespace arbiter::top {
namespace {

constexpr const char* kOnce = "; `arbiter top --once` prints one picture as text";

std::string terminal_name() {
  const char* const name = std::getenv("TERM");
  return name == nullptr ? "" : name;
}

// The Linux console's description, for one, has no size, and curses fails without one. The
// variables must be set before there are threads.
void describe_size() {
  if (::tigetnum("lines") > 0 && ::tigetnum("cols") > 0) return;
  ::use_env(TRUE);
  ::setenv("LINES", "24", 0);
  ::setenv("COLUMNS", "80", 0);
}

}  // namespace

void require_terminal() {
  if (::isatty(STDIN_FILENO) == 0 || ::isatty(STDOUT_FILENO) == 0) {
    throw ScreenError(std::string("this is not a terminal") + kOnce);
  }
  if (terminal_name().empty()) {
    throw ScreenError(std::string("TERM is not set, which says what the terminal is") + kOnce);
  }
  const std::string what = "TERM is \"" + terminal_name() + "\", ";
  ::use_env(FALSE);  // curses would make room for all that the terminal says that it has
  int error = 0;
  if (::setupterm(nullptr, STDOUT_FILENO, &error) != OK) {
    throw ScreenError(what + "of which there is no description" + kOnce);
  }
  char* const move = ::tigetstr("cup");
  // It is -1 where the terminal's description says that it is no string.
  const bool can_move = move != nullptr && reinterpret_cast<std::intptr_t>(move) != -1;
  if (can_move) describe_size();
  ::del_curterm(::set_curterm(nullptr));
  if (!can_move) throw ScreenError(what + "a terminal that cannot move its cursor" + kOnce);
}

Charset charset_of_locale() {
  std::setlocale(LC_CTYPE, "");
  const bool is_utf8 = std::strcmp(::nl_langinfo(CODESET), "UTF-8") == 0;
  return is_utf8 ? Charset::kUtf8 : Charset::kAscii;
}

}  // namespace arbiter::top
