// What is happening and why, in two sentences.
#pragma once

#include <string>

#include "story.hpp"

namespace search_and_track {

struct Caption {
  std::string what;
  std::string why;
};

// Explains what was seen by the paper's model if it is that which runs; else tells only the facts.
class Captions {
 public:
  explicit Captions(bool papers_model) : papers_model_(papers_model) {}
  [[nodiscard]] const Caption& at(const Story& story, double now);

 private:
  bool papers_model_;
  Winner gaze_ = kNotYetKnown;
  Winner arm_ = kNotYetKnown;
  Caption caption_{"The components are starting.", "Each is a process; none knows of the others."};
};

}  // namespace search_and_track
