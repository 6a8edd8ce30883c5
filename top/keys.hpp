// What is typed, and what it does.
#pragma once

#include <string>
#include <vector>

namespace arbiter::top {

enum class Key {
  kCharacter,
  kUp,
  kDown,
  kPageUp,
  kPageDown,
  kHome,
  kEnd,
  kLeft,
  kRight,
  kTab,
  kBackTab,
  kEnter,
  kEscape,
  kBackspace,
};
struct KeyPress {
  Key key = Key::kCharacter;
  std::string character;  // in UTF-8, of kCharacter
};

enum class Command {
  kNone,
  kQuit,
  kUp,
  kDown,
  kPageUp,
  kPageDown,
  kTop,
  kBottom,
  kNextPane,
  kPreviousPane,
  kSort,
  kReverse,
  kFilter,
  kPause,
  kBack,
  kForward,
  kBackFar,
  kForwardFar,
  kWhy,
  kTap,
  kHelp,
  kEscape,
};
[[nodiscard]] Command command_of(const KeyPress& press);

struct Binding {
  std::string label;  // one word: "q", "PgUp"
  KeyPress press;
  Command command = Command::kNone;
};
// All that command_of() knows. Ctrl-C, Ctrl-L and Ctrl-Z are the terminal's.
[[nodiscard]] const std::vector<Binding>& bindings();

// The keys, and behind two blanks or more what they do: of any length. For `?` and --help.
[[nodiscard]] const std::vector<std::string>& key_lines();
// What `?` shows: these, and what the columns mean.
[[nodiscard]] std::vector<std::string> help_lines();

}  // namespace arbiter::top
