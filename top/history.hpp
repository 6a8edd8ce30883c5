// What was just seen: the last pictures and changes of winners, and which of them is looked at.
#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <vector>

#include "top/frame.hpp"

namespace arbiter::top {

class History {
 public:
  // How many pictures are kept, at least 1, and how many changes. Fewer of large instances: all of
  // them together take at most some 32 MiB, and as much again during a pause.
  explicit History(std::size_t max_frames, std::size_t max_takeovers = 1000);

  void add(std::shared_ptr<const Frame> frame, std::vector<Takeover> takeovers);

  // A pause keeps all that there is now, for as long as it lasts; what comes meanwhile is kept too,
  // and is there after it.
  [[nodiscard]] bool is_paused() const { return paused_.has_value(); }
  void pause();
  void resume() { paused_.reset(); }
  // Pauses if need be. Negative: back. Stops at the ends.
  void step(std::ptrdiff_t by);

  // The one that is looked at. Null: nothing was added yet.
  [[nodiscard]] std::shared_ptr<const Frame> frame() const;
  // The last one, pause or not.
  [[nodiscard]] std::shared_ptr<const Frame> latest() const;
  // That had come about by then, the latest first.
  [[nodiscard]] std::vector<const Takeover*> takeovers() const;
  // From the picture to the last that can be stepped to.
  [[nodiscard]] shm::Nanoseconds age() const;

 private:
  struct Kept {
    std::deque<std::shared_ptr<const Frame>> frames;
    std::deque<std::shared_ptr<const Takeover>> takeovers;
  };
  struct Pause {
    Kept kept;
    std::size_t at = 0;  // in kept.frames
  };
  [[nodiscard]] const Kept& shown() const { return paused_ ? paused_->kept : live_; }

  const std::size_t max_frames_;
  const std::size_t max_takeovers_;
  Kept live_;
  std::optional<Pause> paused_;
};

}  // namespace arbiter::top
