// How the demo shows itself: as a picture in a terminal, or in lines.
#pragma once

#include <memory>
#include <string>

#include "story.hpp"

namespace search_and_track {

class View {
 public:
  virtual ~View() = default;
  // At another winner.
  virtual void changed(const Story& story, std::size_t receiver) = 0;
  // About twelve times a second.
  virtual void tick(const Story& story, double now) = 0;
};

struct ViewOptions {
  double seconds;
  std::string title;
  bool papers_model;
};

[[nodiscard]] std::unique_ptr<View> make_picture(const ViewOptions& options);
[[nodiscard]] std::unique_ptr<View> make_lines(const ViewOptions& options);

}  // namespace search_and_track
