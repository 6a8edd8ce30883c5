// What everything in a picture looks like and means: one table, from which the pictures, their
// legend and `arbiter graph --help` are made, and which a test compares with the documentation.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace arbiter::drawing {

// Colours that people with any kind of colour blindness can tell apart by hue or by lightness (most
// are Okabe's and Ito's). Nothing is said by colour alone: lines differ in width, dashes and heads
// too, and boxes have signs.
namespace colour {
inline constexpr const char* kRed = "#C8102E";
inline constexpr const char* kPaleRed = "#E799A5";
inline constexpr const char* kBlue = "#0072B2";
inline constexpr const char* kGreen = "#009E73";
inline constexpr const char* kOrange = "#E69F00";
inline constexpr const char* kBlack = "#444444";
inline constexpr const char* kGrey = "#999999";
inline constexpr const char* kPaleGreen = "#BFE8DC";
inline constexpr const char* kPaleOrange = "#FCE7BF";
inline constexpr const char* kPaleBlue = "#CDE8F8";
inline constexpr const char* kWhite = "#FFFFFF";
inline constexpr const char* kPaleGrey = "#F4F4F4";
inline constexpr const char* kShade = "#E4E4E4";
}  // namespace colour

enum class LineKind : std::uint8_t {
  kInhibits,
  kInhibitsPast,
  kSelected,
  kSensed,
  kUnarbitrated,
  kWithoutRule,
  kWins,
  kOverridden,
  kInactive,
};

struct Line {
  LineKind kind;
  const char* colour;
  const char* word;    // what a reader calls the colour
  const char* sample;  // what the line looks like, in one word of text
  const char* width;
  const char* style;  // of Graphviz, as is the head
  const char* head;
  const char* meaning;
};

inline constexpr std::array<Line, 9> kLines{{
    {LineKind::kInhibits, colour::kRed, "red", "━━▶", "1.8", "", "", "inhibits"},
    {LineKind::kInhibitsPast, colour::kPaleRed, "pale red", "──▶", "0.9", "", "",
     "inhibits, too, past those in between"},
    {LineKind::kSelected, colour::kBlack, "black", "──▶", "1", "", "",
     "a connection that a rule can select"},
    {LineKind::kSensed, colour::kBlue, "blue", "╌╌○", "1", "dashed", "odot",
     "only sensed: rules read it"},
    {LineKind::kUnarbitrated, colour::kGrey, "grey", "──▶", "1", "", "",
     "a connection to a port without an arbiter"},
    {LineKind::kWithoutRule, colour::kGrey, "grey", "┈┈▶", "1", "dotted", "",
     "a connection without a rule: never delivers"},
    {LineKind::kWins, colour::kGreen, "green", "━━▶", "3", "", "", "wins now"},
    {LineKind::kOverridden, colour::kOrange, "orange", "╌╌▶", "1.5", "dashed", "",
     "is active, and overridden"},
    {LineKind::kInactive, colour::kGrey, "grey", "──▷", "1", "", "empty", "is inactive"},
}};

constexpr const Line& look_of(LineKind kind) { return kLines[static_cast<std::size_t>(kind)]; }

// What behaviours, rules and sources do now.
enum class MarkKind : std::uint8_t { kRuns, kOverridden, kActive, kInactive };

struct Mark {
  MarkKind kind;
  const char* colour;
  const char* word;
  const char* sign;
  const char* meaning;
};

inline constexpr std::array<Mark, 4> kMarks{{
    {MarkKind::kRuns, colour::kPaleGreen, "green", "▶", "runs: it wins somewhere"},
    {MarkKind::kOverridden, colour::kPaleOrange, "orange", "✕", "active, and overridden"},
    {MarkKind::kActive, colour::kPaleBlue, "blue", "●", "an active source"},
    {MarkKind::kInactive, colour::kWhite, "white", "○", "inactive"},
}};

constexpr const Mark& look_of(MarkKind kind) { return kMarks[static_cast<std::size_t>(kind)]; }

// What is said beside arrows, and around boxes.
struct Sign {
  const char* text;
  const char* meaning;
  const char* colour = colour::kRed;
};

inline constexpr const char* kAllAfter = "⇊ all after it";
inline constexpr const char* kMutual = "⇄ each other";
inline constexpr const char* kHostBox = "▭ host";

inline constexpr std::array<Sign, 3> kSigns{{
    {kAllAfter, "inhibits all that its arrows lead to, by way of others too"},
    {kMutual, "in such a frame each inhibits the others"},
    {kHostBox,
     "the ports that a host decides, and the sources that live there; arrows from another box, and "
     "sources with a host behind their names, cross the network",
     colour::kBlack},
}};

}  // namespace arbiter::drawing
