// The terminal, by ncurses.
//
// It is taken when the screen is made and given back when that is destroyed, however that comes
// about, and while the program is stopped by SIGTSTP (Ctrl-Z). So it takes the signals that would
// end the program without a word, such as SIGQUIT (Ctrl-\), and says that one has come. There can
// be one at a time, in the one thread that does not block these signals.
#pragma once

#include <optional>
#include <stdexcept>
#include <vector>

#include "shm/file_descriptor.hpp"
#include "top/keys.hpp"
#include "top/line.hpp"
#include "top/view.hpp"

namespace arbiter::top {

// There is no terminal, or none that can show a screen: the message says so, and what to do.
class ScreenError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Throws ScreenError unless standard input and output are a terminal that a screen can be drawn on.
// Writes nothing. Called before there are threads, and before a Screen.
void require_terminal();

// What the user's locale (LC_CTYPE) can show, which the program takes over by this.
[[nodiscard]] Charset charset_of_locale();

class Screen {
 public:
  // Throws ScreenError.
  Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  ~Screen();

  [[nodiscard]] Size size() const;
  // Readable when the terminal has another size, or the program is to stop or to end; read_key()
  // takes it up, and the screen must be shown again.
  [[nodiscard]] int signals() const noexcept { return signals_.get(); }
  // A signal that the screen takes asked the program to end.
  [[nodiscard]] bool is_asked_to_end() const noexcept { return is_asked_to_end_; }
  void show(const std::vector<Line>& lines) const;
  // Nothing: none is waiting. Does not block.
  std::optional<KeyPress> read_key();

 private:
  void take_up_signals();
  static void take_up_size();
  static void stop();

  const Charset charset_;
  const shm::FileDescriptor signals_;
  bool has_colours_ = false;
  bool is_asked_to_end_ = false;
};

}  // namespace arbiter::top
