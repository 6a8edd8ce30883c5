#include "summary.hpp"

#include <algorithm>
#include <cstdio>

#include "scene.hpp"

namespace search_and_track {
namespace {

constexpr std::size_t kColumnWidth = 34;

std::string seconds(double time) {
  char text[32];
  std::snprintf(text, sizeof text, "%5.1f s", time);
  return text;
}

std::string padded(std::string text) {
  text.resize(std::max(text.size(), kColumnWidth), ' ');
  return text;
}

std::vector<Winner> winners_at(const ReceiverState& receiver) {
  std::vector<Winner> winners;
  for (const Reign& reign : receiver.reigns) winners.push_back(reign.winner);
  return winners;
}

std::string names_of(const std::vector<Winner>& winners) {
  std::string text;
  for (const Winner winner : winners) text += (text.empty() ? "" : ", ") + name_of(winner);
  return text;
}

}  // namespace

std::string name_of(Winner winner) {
  if (winner == kNotYetKnown) return "-";
  return std::string(winner == kNobody ? kIdle : kSenders[winner].port);
}

std::string line_for(std::size_t receiver, const Reign& reign) {
  std::string port(kReceivers[receiver].port);
  port.resize(11, ' ');
  return seconds(reign.since) + "  " + port + "  " + name_of(reign.winner);
}

std::string table_of(const Story& story) {
  std::string text = "  " + padded("at " + std::string(kReceivers[kGaze].port)) + "at " +
                     std::string(kReceivers[kArm].port) + "\n";
  const auto& gaze = story.receiver(kGaze).reigns;
  const auto& arm = story.receiver(kArm).reigns;
  const auto entry = [](const std::vector<Reign>& reigns, std::size_t row) {
    if (row >= reigns.size()) return std::string();
    return seconds(reigns[row].since) + "  " + name_of(reigns[row].winner);
  };
  for (std::size_t row = 0; row < std::max(gaze.size(), arm.size()); ++row) {
    std::string line = padded(entry(gaze, row)) + entry(arm, row);
    line.erase(line.find_last_not_of(' ') + 1);
    text += "  " + line + "\n";
  }
  return text;
}

bool is_as_in_the_paper(const Story& story) {
  for (std::size_t i = 0; i < kReceivers.size(); ++i) {
    if (winners_at(story.receiver(i)) != winners_of_the_paper()[i]) return false;
  }
  return true;
}

std::string verdict_on(const Story& story) {
  if (is_as_in_the_paper(story)) {
    return "These are the winners that the paper's model demands, in its order.\n";
  }
  std::string text = "This is NOT what the paper's model demands:\n";
  for (std::size_t i = 0; i < kReceivers.size(); ++i) {
    text += "  at " + std::string(kReceivers[i].port) + ": " + names_of(winners_of_the_paper()[i]) +
            "\n";
  }
  return text;
}

}  // namespace search_and_track
