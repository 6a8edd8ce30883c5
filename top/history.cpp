#include "top/history.hpp"

#include <algorithm>
#include <utility>

namespace arbiter::top {
namespace {

constexpr std::size_t kMostBytes = std::size_t{32} << 20;

std::size_t bytes_of(const Frame& frame) {
  return sizeof frame + frame.ports.size() * sizeof(PortState) +
         frame.words.size() * sizeof(shm::ActivityWord) +
         frame.slow_periods.size() * sizeof(shm::Nanoseconds);
}

}  // namespace

History::History(std::size_t max_frames, std::size_t max_takeovers)
    : max_frames_(std::max<std::size_t>(max_frames, 1)), max_takeovers_(max_takeovers) {}

void History::add(std::shared_ptr<const Frame> frame, std::vector<Takeover> takeovers) {
  for (Takeover& each : takeovers) {
    live_.takeovers.push_back(std::make_shared<const Takeover>(std::move(each)));
    if (live_.takeovers.size() > max_takeovers_) live_.takeovers.pop_front();
  }
  if (frame == nullptr) return;
  live_.frames.push_back(std::move(frame));
  const std::size_t most =
      std::clamp<std::size_t>(kMostBytes / bytes_of(*live_.frames.back()), 1, max_frames_);
  while (live_.frames.size() > most) live_.frames.pop_front();
}

void History::pause() {
  if (paused_ || live_.frames.empty()) return;
  paused_ = Pause{live_, live_.frames.size() - 1};
}

void History::step(std::ptrdiff_t by) {
  pause();
  if (!paused_) return;
  const auto last = static_cast<std::ptrdiff_t>(paused_->kept.frames.size()) - 1;
  const auto at = static_cast<std::ptrdiff_t>(paused_->at) + by;
  paused_->at = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(at, 0, last));
}

std::shared_ptr<const Frame> History::frame() const {
  return paused_ ? paused_->kept.frames[paused_->at] : latest();
}

std::shared_ptr<const Frame> History::latest() const {
  return live_.frames.empty() ? nullptr : live_.frames.back();
}

std::vector<const Takeover*> History::takeovers() const {
  const auto now = frame();
  std::vector<const Takeover*> result;
  const auto& all = shown().takeovers;
  for (const auto& each : all) {
    if (now != nullptr && each->number <= now->takeovers) result.push_back(each.get());
  }
  std::reverse(result.begin(), result.end());
  return result;
}

shm::Nanoseconds History::age() const {
  return paused_ ? paused_->kept.frames.back()->now - frame()->now : 0;
}

}  // namespace arbiter::top
