// What has happened so far, as the components themselves tell it: the senders, what became of what
// they sent; the receivers, who commanded them, and when nobody did.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

#include "cast.hpp"

namespace search_and_track {

struct SenderState {
  bool sends = false;
  unsigned delivered = 0;  // at how many input ports its last sample was
  unsigned discarded = 0;
  double silent_since = -1e9;
  struct Span {
    double from;
    double to;  // the end of time while it goes on
  };
  std::vector<Span> spans;
};

struct Reign {
  double since = 0;
  Winner winner = kNotYetKnown;
};

struct ReceiverState {
  std::vector<Reign> reigns;
  std::array<double, 3> position{};
  unsigned samples = 0;  // how many have come

  [[nodiscard]] Winner winner() const {
    return reigns.empty() ? kNotYetKnown : reigns.back().winner;
  }
};

class Story {
 public:
  // Times are seconds from the start. Throws std::runtime_error for a line that no component says.
  void sender_said(std::size_t sender, std::string_view line, double now);
  // True if the port has another winner now.
  bool receiver_said(std::size_t receiver, std::string_view line, double now);

  [[nodiscard]] const SenderState& sender(std::size_t index) const { return senders_[index]; }
  [[nodiscard]] const ReceiverState& receiver(std::size_t index) const { return receivers_[index]; }
  // When a winner changed last.
  [[nodiscard]] double last_change() const { return last_change_; }

 private:
  std::array<SenderState, kSenders.size()> senders_;
  std::array<ReceiverState, kReceivers.size()> receivers_;
  double last_change_ = 0;
};

}  // namespace search_and_track
