#include "top/keys.hpp"

#include <algorithm>

namespace arbiter::top {
namespace {

KeyPress character(const std::string& text) { return {Key::kCharacter, text}; }

const std::vector<std::string>& column_lines() {
  static const std::vector<std::string> lines = {
      "In all columns   0: none; ?: not known, or not yet; empty: nothing to tell, as if not open",
      "",
      "INPUT PORT       a t before its name: it is tapped",
      "WINNER           who wins; idle: nobody; ! NAME: selected, but cannot deliver",
      "SINCE            how long it has been so; >: at least so long",
      "LAST             since the winner's last arrival",
      "TAKEN            samples per second that the component took",
      "LOST             the same of those that were accepted, but never taken",
      "LOSERS           the same of those that lost the decision when they arrived",
      "QUEUE            samples that wait, and how many one queue can hold",
      "P50 P99          of a tapped port: half, and 99 %, of the samples taken lately waited less",
      "OLDEST           of a tapped port: how long the oldest sample that waits has waited at most",
      "",
      "SOURCE           a bar shrinks until the activity ends, T after the last arrival",
      "RATE SIGNALS     samples and signals per second",
      "CHANGE           each change of a winner that was seen, and what made it",
      "",
      "Rates and queues are read once a second; all else is what decisions see.",
      "Where the screen is narrow, columns are left out and names cut; Enter shows them whole.",
  };
  return lines;
}

}  // namespace

const std::vector<Binding>& bindings() {
  static const std::vector<Binding> all = {
      {"q", character("q"), Command::kQuit},
      {"Up", {Key::kUp, ""}, Command::kUp},
      {"k", character("k"), Command::kUp},
      {"Down", {Key::kDown, ""}, Command::kDown},
      {"j", character("j"), Command::kDown},
      {"PgUp", {Key::kPageUp, ""}, Command::kPageUp},
      {"PgDn", {Key::kPageDown, ""}, Command::kPageDown},
      {"Home", {Key::kHome, ""}, Command::kTop},
      {"g", character("g"), Command::kTop},
      {"End", {Key::kEnd, ""}, Command::kBottom},
      {"G", character("G"), Command::kBottom},
      {"Tab", {Key::kTab, ""}, Command::kNextPane},
      {"Shift-Tab", {Key::kBackTab, ""}, Command::kPreviousPane},
      {"Enter", {Key::kEnter, ""}, Command::kWhy},
      {"w", character("w"), Command::kWhy},
      {"t", character("t"), Command::kTap},
      {"/", character("/"), Command::kFilter},
      {"Esc", {Key::kEscape, ""}, Command::kEscape},
      {"s", character("s"), Command::kSort},
      {"r", character("r"), Command::kReverse},
      {"Space", character(" "), Command::kPause},
      {"p", character("p"), Command::kPause},
      {"Left", {Key::kLeft, ""}, Command::kBack},
      {"h", character("h"), Command::kBack},
      {"Right", {Key::kRight, ""}, Command::kForward},
      {"l", character("l"), Command::kForward},
      {"[", character("["), Command::kBackFar},
      {"]", character("]"), Command::kForwardFar},
      {"?", character("?"), Command::kHelp},
  };
  return all;
}

Command command_of(const KeyPress& press) {
  const auto& all = bindings();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Binding& each) {
    return each.press.key == press.key &&
           (press.key != Key::kCharacter || each.press.character == press.character);
  });
  return found == all.end() ? Command::kNone : found->command;
}

const std::vector<std::string>& key_lines() {
  static const std::vector<std::string> lines = {
      "q Ctrl-C         leave; q closes a window that is open",
      "Up Down k j      move the cursor",
      "PgUp PgDn        move it by a page",
      "Home End g G     move it to the first row, to the last",
      "Tab Shift-Tab    the next pane, the one before",
      "Enter w          why: who wins at the cursor, and what keeps the others out",
      "t                tap the port, or stop: no winner is missed then; its publishers pay for it",
      "/                filter: only rows with a text in one of their names; Enter keeps it",
      "Esc              show all rows again; close what is open",
      "s r              sort by the next column; the other way round",
      "Space p          pause, and go on",
      "Left Right h l   step back, and forward again, by one picture",
      "[ ]              the same by ten pictures",
      "? Ctrl-L         this help; draw the screen again",
  };
  return lines;
}

std::vector<std::string> help_lines() {
  std::vector<std::string> lines = key_lines();
  lines.emplace_back();
  lines.insert(lines.end(), column_lines().begin(), column_lines().end());
  return lines;
}

}  // namespace arbiter::top
