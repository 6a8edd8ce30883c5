#include "top/screen.hpp"

#define NCURSES_NOMACROS 1
#define NCURSES_WIDECHAR 1
#include <ncurses.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include "shm/utf8.hpp"

namespace arbiter::top {
namespace {

// How long an escape may be the beginning of a key's sequence.
constexpr int kEscapeMs = 50;

// A terminal may say that it has millions of cells. What is kept, drawn and compared ten times a
// second is bounded: of a larger one, the rest stays empty.
constexpr int kMostRows = 300;
constexpr int kMostColumns = 600;

bool wants_colours() {
  const char* const no = std::getenv("NO_COLOR");  // https://no-color.org
  return no == nullptr || *no == '\0';
}
int number_in(const char* variable) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? 0 : std::atoi(text);
}
constexpr wint_t kRedraw = 'L' & 0x1f;  // Ctrl-L

constexpr short kGreen = 1;
constexpr short kYellow = 2;
constexpr short kRed = 3;
constexpr short kCyan = 4;

// Colours say nothing that a word or a mark does not.
chtype attributes(Style style, bool has_colours) {
  const auto colour = [&](short pair) -> chtype {
    return has_colours ? static_cast<chtype>(COLOR_PAIR(pair)) : 0;
  };
  switch (style) {
    case Style::kTitle:
      return A_BOLD | colour(kCyan);
    case Style::kHeader:
      return A_UNDERLINE;
    case Style::kDim:
      return A_DIM;
    case Style::kWinner:
      return has_colours ? colour(kGreen) : A_BOLD;
    case Style::kBar:
      return colour(kGreen);
    case Style::kIdle:
      return colour(kYellow);
    case Style::kWarning:
      return A_BOLD | colour(kRed);
    case Style::kPlain:
      break;
  }
  return A_NORMAL;
}

std::optional<Key> key_of(wint_t code) {
  static const std::map<wint_t, Key> keys = {
      {KEY_UP, Key::kUp},          {KEY_DOWN, Key::kDown},          {KEY_PPAGE, Key::kPageUp},
      {KEY_NPAGE, Key::kPageDown}, {KEY_HOME, Key::kHome},          {KEY_END, Key::kEnd},
      {KEY_LEFT, Key::kLeft},      {KEY_RIGHT, Key::kRight},        {KEY_BTAB, Key::kBackTab},
      {KEY_ENTER, Key::kEnter},    {KEY_BACKSPACE, Key::kBackspace}};
  const auto found = keys.find(code);
  return found == keys.end() ? std::nullopt : std::optional(found->second);
}

std::optional<KeyPress> press_of(wint_t character) {
  switch (character) {
    case '\t':
      return KeyPress{Key::kTab, ""};
    case '\r':
    case '\n':
      return KeyPress{Key::kEnter, ""};
    case '\x1b':
      return KeyPress{Key::kEscape, ""};
    case '\b':
    case '\x7f':
      return KeyPress{Key::kBackspace, ""};
    default:
      break;
  }
  if (shm::is_control(static_cast<std::uint32_t>(character))) return std::nullopt;
  return KeyPress{Key::kCharacter, shm::encode_utf8(static_cast<std::uint32_t>(character))};
}

void set_handler(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  ::sigaction(signal, &action, nullptr);
}

// Those that end a program from outside, but for SIGINT, SIGTERM and SIGHUP, which have been caught
// before, and SIGKILL. One that is ignored, or that somebody uses, is left alone.
void add_ends(sigset_t& caught) {
  const auto add = [&](int signal) {
    struct sigaction action {};
    if (::sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_DFL) {
      sigaddset(&caught, signal);
    }
  };
  for (const int signal : {SIGQUIT, SIGUSR1, SIGUSR2, SIGALRM, SIGVTALRM, SIGPROF, SIGIO, SIGPWR,
                           SIGSTKFLT, SIGXCPU}) {
    add(signal);
  }
  for (int signal = SIGRTMIN; signal <= SIGRTMAX; ++signal) add(signal);
}

// As a descriptor, so that none is missed between two looks. ncurses ignores SIGTSTP while it
// writes, and a Ctrl-Z of that moment would be lost; it leaves those alone that are ignored before
// it comes, and blocked signals are kept, ignored or not.
shm::FileDescriptor catch_signals() {
  sigset_t caught;
  sigemptyset(&caught);
  sigaddset(&caught, SIGWINCH);
  sigaddset(&caught, SIGTSTP);
  add_ends(caught);
  ::sigprocmask(SIG_BLOCK, &caught, nullptr);
  set_handler(SIGTSTP, SIG_IGN);
  return shm::FileDescriptor(::signalfd(-1, &caught, SFD_CLOEXEC | SFD_NONBLOCK));
}

}  // namespace

Screen::Screen() : charset_(charset_of_locale()), signals_(catch_signals()) {
  if (::newterm(nullptr, stdout, stdin) == nullptr) {
    throw ScreenError("this terminal cannot be used; see `arbiter top --once`");
  }
  take_up_size();
  ::cbreak();
  ::noecho();
  ::nonl();
  ::keypad(stdscr, TRUE);
  ::nodelay(stdscr, TRUE);
  ::set_escdelay(kEscapeMs);
  ::curs_set(0);
  has_colours_ = wants_colours() && ::has_colors() && ::start_color() == OK;
  if (!has_colours_) return;
  const short background = ::use_default_colors() == OK ? short{-1} : short{COLOR_BLACK};
  ::init_pair(kGreen, COLOR_GREEN, background);
  ::init_pair(kYellow, COLOR_YELLOW, background);
  ::init_pair(kRed, COLOR_RED, background);
  ::init_pair(kCyan, COLOR_CYAN, background);
}

Screen::~Screen() { ::endwin(); }

Size Screen::size() const {
  return {static_cast<std::size_t>(std::max(::getmaxx(stdscr), 0)),
          static_cast<std::size_t>(std::max(::getmaxy(stdscr), 0))};
}

void Screen::show(const std::vector<Line>& lines) const {
  const Size size = this->size();
  ::erase();
  for (std::size_t row = 0; row < lines.size() && row < size.rows; ++row) {
    ::move(static_cast<int>(row), 0);
    std::size_t left = size.columns;
    for (const Span& span : lines[row].spans) {
      const std::size_t width = std::min(columns_of(span.text), left);
      const std::string text = fit(span.text, width, Align::kLeft, charset_);
      left -= width;
      ::attrset(static_cast<int>(attributes(span.style, has_colours_) |
                                 (lines[row].is_selected ? A_REVERSE : 0)));
      ::addstr(text.c_str());
    }
  }
  ::attrset(A_NORMAL);
  ::refresh();
}

void Screen::take_up_signals() {
  signalfd_siginfo signal{};
  while (::read(signals_.get(), &signal, sizeof signal) > 0) {
    if (signal.ssi_signo == SIGTSTP) {
      stop();
    } else if (signal.ssi_signo != SIGWINCH) {
      is_asked_to_end_ = true;
    }
    take_up_size();
  }
}

// What is on the terminal now is the terminal's guess, even if it has its old size again.
void Screen::take_up_size() {
  winsize size{};
  const bool is_known = ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0;
  const int rows = is_known && size.ws_row != 0 ? size.ws_row : number_in("LINES");
  const int columns = is_known && size.ws_col != 0 ? size.ws_col : number_in("COLUMNS");
  // What nobody knows is as the description of the terminal has it.
  ::resizeterm(rows > 0 ? std::min(rows, kMostRows) : ::getmaxy(stdscr),
               columns > 0 ? std::min(columns, kMostColumns) : ::getmaxx(stdscr));
  ::clearok(curscr, TRUE);
}

// Returns when it goes on.
void Screen::stop() {
  ::endwin();
  set_handler(SIGTSTP, SIG_DFL);
  sigset_t caught;
  sigemptyset(&caught);
  sigaddset(&caught, SIGTSTP);
  ::raise(SIGTSTP);
  ::sigprocmask(SIG_UNBLOCK, &caught, nullptr);  // here
  ::sigprocmask(SIG_BLOCK, &caught, nullptr);
  set_handler(SIGTSTP, SIG_IGN);
}

std::optional<KeyPress> Screen::read_key() {
  take_up_signals();
  for (;;) {
    wint_t code = 0;
    const int kind = ::get_wch(&code);
    if (kind == ERR) return std::nullopt;
    if (kind == KEY_CODE_YES) {
      if (const auto key = key_of(code)) return KeyPress{*key, ""};
    } else if (code == kRedraw) {
      ::clearok(curscr, TRUE);
    } else if (auto press = press_of(code)) {
      return press;
    }
  }
}

}  // namespace arbiter::top
