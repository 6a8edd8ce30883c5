#include "view.hpp"

#include <algorithm>
#include <cstdio>

#include "captions.hpp"
#include "diagram.hpp"
#include "terminal.hpp"
#include "timeline.hpp"

namespace search_and_track {
namespace {

constexpr int kRows = 24;
constexpr int kColumns = 80;

class Picture : public View {
 public:
  explicit Picture(const ViewOptions& options)
      : options_(options), captions_(options.papers_model) {}

  void changed(const Story&, std::size_t) override {}

  void tick(const Story& story, double now) override {
    Canvas canvas(kRows, kColumns);
    draw_header(canvas, now);
    draw_diagram(canvas, 2, story, now);
    const Caption& caption = captions_.at(story, now);
    canvas.put(14, 1, "▌", kBold);
    canvas.put(15, 1, "▌", kBold);
    canvas.put(14, 3, caption.what, kBold);
    canvas.put(15, 3, caption.why);
    draw_timeline(canvas, 17, story, now, options_.seconds);
    const Terminal::Size size = terminal_.size();
    Terminal::write(canvas.drawn(size.rows, size.columns, terminal_.is_coloured()));
  }

 private:
  void draw_header(Canvas& canvas, double now) const {
    const int after = canvas.put(0, 1, options_.title, kBold);
    canvas.put(0, after + 2, "seven processes, one arbiterd", kDim);
    char clock[32];
    const int length = std::snprintf(clock, sizeof clock, "%.1f s of %g",
                                     std::min(now, options_.seconds), options_.seconds);
    canvas.put(0, kColumns - 1 - length, clock, kDim);
  }

  ViewOptions options_;
  Captions captions_;
  Terminal terminal_;
};

}  // namespace

std::unique_ptr<View> make_picture(const ViewOptions& options) {
  return std::make_unique<Picture>(options);
}

}  // namespace search_and_track
