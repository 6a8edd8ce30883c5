// Rows, from the first:      columns:  name         wires              bus     box
//    0  Random Look     ────────────────────────────────────────────────╮
//    2  Face Detector   ────────────────────────────────────────────────┼──▶ Gaze Control
//    4                       ╭───────────────────────────────────────────╯
//    5  Object Detector ─────┤
//    6                       ╰───────────────────────────────────────────╮
//    8  Rest Arm        ────────────────────────────────────────────────┴──▶ Arm Control
//   10  Collision Detector, which no wire leaves
// Each piece of wire belongs to one connection, except those past a bus: these are the winner's.
#include "diagram.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

namespace search_and_track {
namespace {

constexpr int kName = 3;
constexpr int kWire = 22;
constexpr int kFork = 27;
constexpr int kBus = 44;
constexpr int kBox = 48;
constexpr int kBoxWidth = 31;
constexpr std::array<int, 5> kRowOf{0, 2, 5, 8, 10};  // of each sender
constexpr std::array<int, 2> kEntryOf{2, 8};          // of each receiver
// How long an activity outlasts its last sample: the model's timeout.
constexpr double kActivity = 0.5;
// How far apart the bright spots on a winner's wire are.
constexpr unsigned kSpotDistance = 6;

enum class Wire { quiet, cut, carries };

class Diagram {
 public:
  Diagram(Canvas& canvas, int top, const Story& story, double now)
      : canvas_(canvas), top_(top), story_(story), now_(now) {}

  void draw() {
    for (std::size_t sender = 0; sender < kSenders.size(); ++sender) draw_sender(sender);
    draw_collision();
    draw_random_look();
    draw_object();
    draw_straight(kFace, kGaze);
    draw_straight(kRestArm, kArm);
    for (std::size_t receiver = 0; receiver < kReceivers.size(); ++receiver) {
      draw_entry(receiver);
      draw_box(receiver);
    }
    draw_head(top_ + 3);
    draw_hand(top_ + 9);
  }

 private:
  [[nodiscard]] bool is_active(std::size_t sender) const {
    const SenderState& state = story_.sender(sender);
    return state.sends || now_ - state.silent_since < kActivity;
  }
  [[nodiscard]] Wire wire(std::size_t sender, std::size_t receiver) const {
    if (story_.receiver(receiver).winner() == sender) return Wire::carries;
    return story_.sender(sender).sends ? Wire::cut : Wire::quiet;
  }
  [[nodiscard]] static Style style_of(std::size_t sender, Wire wire) {
    if (wire == Wire::carries) return {.colour = kSenders[sender].colour, .bold = true};
    return kDim;
  }
  [[nodiscard]] Style style_of_winner(std::size_t receiver) const {
    const Winner winner = story_.receiver(receiver).winner();
    if (winner == kNotYetKnown) return kDim;
    if (winner == kNobody) return {.colour = Colour::red, .bold = true};
    return {.colour = kSenders[winner].colour, .bold = true};
  }

  void put(int row, int column, std::string_view text, Style style) {
    canvas_.put(top_ + row, column, text, style);
  }

  void draw_sender(std::size_t sender) {
    const SenderState& state = story_.sender(sender);
    const int row = kRowOf[sender];
    const Colour colour = kSenders[sender].colour;
    const bool lingers = !state.sends && is_active(sender);
    const char* const light = state.sends ? "●" : (lingers ? "◐" : "○");
    put(row, 1, light, state.sends || lingers ? Style{.colour = colour, .bold = true} : kDim);
    put(row, kName, kSenders[sender].name, state.sends ? kBold : kDim);
    if (sender != kCollision) put(row + 1, kName, kSenders[sender].port, kDim);
  }

  // It is connected to nothing: that it is active is all that counts.
  void draw_collision() {
    const bool active = is_active(kCollision);
    put(kRowOf[kCollision], kWire, active ? "/collision:o is active" : "/collision:o, only sensed",
        active ? Style{.colour = Colour::red, .bold = true} : kDim);
  }

  // From `from` up to, not including, `to`.
  void draw_wire(int row, int from, int to, std::size_t sender, std::size_t receiver) {
    const Wire state = wire(sender, receiver);
    const Style style = style_of(sender, state);
    switch (state) {
      case Wire::quiet:
        canvas_.repeat(top_ + row, from, to - from, "┈", style);
        break;
      case Wire::cut: {
        canvas_.repeat(top_ + row, from, to - from, "┈", style);
        canvas_.repeat(top_ + row, from, kBus - 15 - from, "─", style);
        put(row, kBus - 15, "✕", {.colour = Colour::red, .bold = true});
        put(row, kBus - 14, " discarded ", style);
        break;
      }
      case Wire::carries:
        canvas_.repeat(top_ + row, from, to - from, "━", style);
        draw_spots(row, from, to, receiver);
        break;
    }
  }

  // They move on by one for each sample that the receiver has got.
  void draw_spots(int row, int from, int to, std::size_t receiver) {
    const unsigned samples = story_.receiver(receiver).samples;
    for (int column = from; column < to; ++column) {
      if ((static_cast<unsigned>(column) + kSpotDistance - samples % kSpotDistance) %
              kSpotDistance !=
          0) {
        continue;
      }
      put(row, column, "╸", style_of_winner(receiver));
    }
  }

  void draw_straight(std::size_t sender, std::size_t receiver) {
    draw_wire(kRowOf[sender], kWire, kBus, sender, receiver);
  }

  void draw_random_look() {
    draw_straight(kRandomLook, kGaze);
    const Wire state = wire(kRandomLook, kGaze);
    const bool bright = state == Wire::carries;
    put(0, kBus, bright ? "┓" : "╮", style_of(kRandomLook, state));
    put(1, kBus, bright ? "┃" : "┊", style_of(kRandomLook, state));
  }

  void draw_object() {
    const Wire gaze = wire(kObject, kGaze);
    const Wire arm = wire(kObject, kArm);
    const bool to_gaze = gaze == Wire::carries;
    const bool to_arm = arm == Wire::carries;
    const Style stub = style_of(kObject, to_gaze || to_arm ? Wire::carries : Wire::cut);
    const bool sends = story_.sender(kObject).sends;
    canvas_.repeat(top_ + 5, kWire, kFork - kWire,
                   to_gaze || to_arm ? "━"
                   : sends           ? "─"
                                     : "┈",
                   stub);
    put(5, kFork, to_gaze && to_arm ? "┫" : to_gaze ? "┛" : to_arm ? "┓" : "┤", stub);
    put(4, kFork, to_gaze ? "┏" : "╭", style_of(kObject, gaze));
    put(6, kFork, to_arm ? "┗" : "╰", style_of(kObject, arm));
    draw_wire(4, kFork + 1, kBus, kObject, kGaze);
    draw_wire(6, kFork + 1, kBus, kObject, kArm);
    put(4, kBus, to_gaze ? "┛" : "╯", style_of(kObject, gaze));
    put(3, kBus, to_gaze ? "┃" : "┊", style_of(kObject, gaze));
    put(6, kBus, to_arm ? "┓" : "╮", style_of(kObject, arm));
    put(7, kBus, to_arm ? "┃" : "┊", style_of(kObject, arm));
  }

  // Where the connections meet: the arbiter lets one through.
  void draw_entry(std::size_t receiver) {
    const Winner winner = story_.receiver(receiver).winner();
    const Style style = style_of_winner(receiver);
    const int row = kEntryOf[receiver];
    const bool nobody = winner == kNobody || winner == kNotYetKnown;
    const char* joint = receiver == kGaze ? "┤" : "┘";
    if (winner == kFace || winner == kRestArm) joint = "━";
    if (winner == kRandomLook || (winner == kObject && receiver == kArm)) joint = "┗";
    if (winner == kObject && receiver == kGaze) joint = "┏";
    put(row, kBus, joint, nobody ? kDim : style);
    put(row, kBus + 1, nobody ? "   " : "━━▶", style);
    if (winner == kNobody) put(row, kBus + 2, "■", style);
  }

  void draw_box(std::size_t receiver) {
    const ReceiverState& state = story_.receiver(receiver);
    const Style style = style_of_winner(receiver);
    const int row = kEntryOf[receiver] - 2;
    for (int i = 1; i < 4; ++i) {
      put(row + i, kBox, "│", style);
      put(row + i, kBox + kBoxWidth - 1, "│", style);
    }
    canvas_.repeat(top_ + row, kBox, kBoxWidth, "─", style);
    canvas_.repeat(top_ + row + 4, kBox, kBoxWidth, "─", style);
    put(row, kBox, "╭", style);
    put(row, kBox + kBoxWidth - 1, "╮", style);
    put(row + 4, kBox, "╰", style);
    put(row + 4, kBox + kBoxWidth - 1, "╯", style);
    const int after =
        canvas_.put(top_ + row, kBox + 2, " " + std::string(kReceivers[receiver].name), kBold);
    put(row, after, " " + std::string(kReceivers[receiver].port) + " ", kDim);

    const Winner winner = state.winner();
    if (winner == kNotYetKnown) return;
    if (winner == kNobody) {
      put(row + 1, kBox + 2, "stopped: nobody commands", style);
    } else {
      put(row + 1, kBox + 2, "obeys", {});
      put(row + 1, kBox + 8, kSenders[winner].name, style);
    }
    char text[64];
    std::snprintf(text, sizeof text, "x %5.2f  y %5.2f  z %5.2f", state.position[0],
                  state.position[1], state.position[2]);
    put(row + 2, kBox + 2, text, kDim);
  }

  // Where the robot looks, from its left to its right.
  void draw_head(int row) {
    const ReceiverState& gaze = story_.receiver(kGaze);
    if (gaze.winner() == kNotYetKnown) return;
    constexpr int kWidth = 15;
    int column = canvas_.put(row, kBox + 2, "left ", kDim);
    canvas_.repeat(row, column, kWidth, "·", kDim);
    const double part = std::clamp(0.5 - gaze.position[1], 0.0, 1.0);
    canvas_.put(row, column + static_cast<int>(std::lround(part * (kWidth - 1))), "◉",
                style_of_winner(kGaze));
    canvas_.put(row, column + kWidth, " right", kDim);
  }

  // How far the arm reaches.
  void draw_hand(int row) {
    const ReceiverState& arm = story_.receiver(kArm);
    if (arm.winner() == kNotYetKnown) return;
    constexpr double kFullReach = 0.4;
    constexpr int kWidth = 25;
    const double part = std::clamp(arm.position[0] / kFullReach, 0.0, 1.0);
    const int length = static_cast<int>(std::lround(part * kWidth));
    const Style style = style_of_winner(kArm);
    canvas_.put(row, kBox + 2, "▐", style);
    canvas_.repeat(row, kBox + 3, kWidth, "·", kDim);
    canvas_.repeat(row, kBox + 3, length - 1, "═", style);
    canvas_.put(row, kBox + 2 + length, "◖", style);
  }

  Canvas& canvas_;
  int top_;
  const Story& story_;
  double now_;
};

}  // namespace

void draw_diagram(Canvas& canvas, int row, const Story& story, double now) {
  Diagram(canvas, row, story, now).draw();
}

}  // namespace search_and_track
