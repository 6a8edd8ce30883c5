#include "top/keys.hpp"

#include <map>

namespace arbiter::top {

Command command_of(const KeyPress& press) {
  static const std::map<Key, Command> keys = {
      {Key::kUp, Command::kUp},         {Key::kDown, Command::kDown},
      {Key::kPageUp, Command::kPageUp}, {Key::kPageDown, Command::kPageDown},
      {Key::kHome, Command::kTop},      {Key::kEnd, Command::kBottom},
      {Key::kLeft, Command::kBack},     {Key::kRight, Command::kForward},
      {Key::kTab, Command::kNextPane},  {Key::kBackTab, Command::kPreviousPane},
      {Key::kEnter, Command::kWhy},     {Key::kEscape, Command::kEscape},
  };
  static const std::map<std::string, Command> characters = {
      {"q", Command::kQuit},    {"k", Command::kUp},         {"j", Command::kDown},
      {"g", Command::kTop},     {"G", Command::kBottom},     {"s", Command::kSort},
      {"r", Command::kReverse}, {"/", Command::kFilter},     {" ", Command::kPause},
      {"p", Command::kPause},   {"h", Command::kBack},       {"l", Command::kForward},
      {"[", Command::kBackFar}, {"]", Command::kForwardFar}, {"w", Command::kWhy},
      {"t", Command::kTap},     {"?", Command::kHelp},
  };
  if (press.key != Key::kCharacter) {
    const auto found = keys.find(press.key);
    return found == keys.end() ? Command::kNone : found->second;
  }
  const auto found = characters.find(press.character);
  return found == characters.end() ? Command::kNone : found->second;
}

const std::vector<std::string>& help_lines() {
  static const std::vector<std::string> lines = {
      "q                leave",
      "up down j k      move the cursor; Page Up, Page Down, g and G: further",
      "Tab              the next pane",
      "Enter w          why: who wins where the cursor is, and what keeps the others out",
      "t                tap the port, (t), or stop: no change of its winner is missed then, not",
      "                 even one that lasts for less than 10 ms; its publishers pay for it",
      "/                filter: rows that contain a text; Esc shows all again",
      "s  r             sort by the next column; the other way round",
      "Space p          pause, and go on",
      "left right h l   step back, and forward again, by one picture",
      "[ ]              by ten pictures",
      "?  Ctrl-L        this help; draw the screen again",
      "",
      "INPUT PORT       SINCE: how long it has been so (> : at least so long)",
      "                 LAST: since the winner's last arrival",
      "                 TAKEN, LOST, LOSERS: samples per second that the component took, that",
      "                 were accepted but never taken, and that lost the decision",
      "                 QUEUE: samples that wait, of how many that one queue can hold",
      "                 OLDEST: of a tapped port, how long the oldest of these has waited at most",
      "                 P50, P99: there, what half and 99 % of those taken had waited less than",
      "SOURCE           a bar shrinks until the activity ends, T after the last arrival",
      "                 RATE, SIGNALS: samples and signals per second",
      "CHANGE           each change of a winner that was seen, and what made it",
      "",
      "Rates and queues are read once a second; all else is what decisions see.",
  };
  return lines;
}

}  // namespace arbiter::top
