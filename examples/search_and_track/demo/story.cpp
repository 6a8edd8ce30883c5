#include "story.hpp"

#include <algorithm>
#include <sstream>
#include <stdexcept>
#include <string>

namespace search_and_track {
namespace {

constexpr double kGoesOn = 1e9;

[[noreturn]] void misunderstood(std::string_view who, std::string_view line) {
  throw std::runtime_error(std::string(who) +
                           " said what nobody understands: " + std::string(line));
}

Winner sender_of(std::string_view port) {
  const auto* const found = std::find_if(kSenders.begin(), kSenders.end(),
                                         [&](const Sender& sender) { return sender.port == port; });
  return static_cast<Winner>(found - kSenders.begin());
}

}  // namespace

// "silent", or "delivered N discarded N".
void Story::sender_said(std::size_t sender, std::string_view line, double now) {
  SenderState& state = senders_[sender];
  if (line == "silent") {
    if (!state.sends) return;
    state.sends = false;
    state.silent_since = now;
    state.spans.back().to = now;
    return;
  }
  std::istringstream words{std::string(line)};
  std::string word;
  if (!(words >> word >> state.delivered >> word >> state.discarded)) {
    misunderstood(kSenders[sender].name, line);
  }
  if (!state.sends) state.spans.push_back({now, kGoesOn});
  state.sends = true;
}

// "idle", or "SOURCE X Y Z".
bool Story::receiver_said(std::size_t receiver, std::string_view line, double now) {
  ReceiverState& state = receivers_[receiver];
  Winner winner = kNobody;
  if (line != kIdle) {
    std::istringstream words{std::string(line)};
    std::string source;
    if (!(words >> source >> state.position[0] >> state.position[1] >> state.position[2])) {
      misunderstood(kReceivers[receiver].name, line);
    }
    winner = sender_of(source);
    if (winner == kSenders.size()) misunderstood(kReceivers[receiver].name, line);
    ++state.samples;
  }
  if (winner == state.winner()) return false;
  state.reigns.push_back({now, winner});
  last_change_ = now;
  return true;
}

}  // namespace search_and_track
