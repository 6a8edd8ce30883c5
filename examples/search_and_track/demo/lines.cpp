#include <iostream>

#include "summary.hpp"
#include "view.hpp"

namespace search_and_track {
namespace {

class Lines : public View {
 public:
  explicit Lines(const ViewOptions& options) {
    std::cout << options.title << ": seven processes, one arbiterd, " << options.seconds
              << " seconds. The winners, as they change:\n\n"
              << std::flush;
  }

  void changed(const Story& story, std::size_t receiver) override {
    std::cout << line_for(receiver, story.receiver(receiver).reigns.back()) << std::endl;
  }

  void tick(const Story&, double) override {}
};

}  // namespace

std::unique_ptr<View> make_lines(const ViewOptions& options) {
  return std::make_unique<Lines>(options);
}

}  // namespace search_and_track
