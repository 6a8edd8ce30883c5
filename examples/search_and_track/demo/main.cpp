// search-and-track-demo: the paper's Search and Track with real processes, and who wins.
#include <chrono>
#include <cmath>
#include <iostream>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "command_line.hpp"
#include "places.hpp"
#include "processes.hpp"
#include "scene.hpp"
#include "signals.hpp"
#include "summary.hpp"
#include "terminal.hpp"
#include "view.hpp"

namespace search_and_track {
namespace {

using Clock = std::chrono::steady_clock;
namespace fs = std::filesystem;

constexpr double kFrame = 1.0 / 12;

struct Options {
  double seconds = kUsualSeconds;
  std::string model;  // empty: the paper's
  bool lines = false;
};

class Demo {
 public:
  explicit Demo(const Options& options)
      : model_(options.model.empty() ? papers_model() : fs::path(options.model)),
        is_papers_model_(options.model.empty()),
        lines_(options.lines || !Terminal::is_there()),
        scene_(scene_of(options.seconds)) {}

  // Returns the exit code.
  int run() {
    std::optional<int> signal;
    {
      Processes processes;
      processes.start_daemon(daemon_program(), model_);
      start_ = Clock::now();
      start_components(processes);
      signal = watch(processes);
    }
    if (signal) std::cout << "\nStopped after " << std::lround(seconds()) << " s.\n";
    std::cout << "\nWho commanded:\n\n" << table_of(story_) << '\n';
    if (signal) return 128 + *signal;
    if (!is_papers_model_) return 0;
    std::cout << verdict_on(story_);
    return is_as_in_the_paper(story_) ? 0 : 1;
  }

 private:
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(Clock::now() - start_).count();
  }

  // The receivers come first: as listen() numbers them.
  void start_components(Processes& processes) {
    for (const Receiver& receiver : kReceivers) {
      processes.start_component(component_program(receiver.program), {});
    }
    for (std::size_t i = 0; i < kSenders.size(); ++i) {
      std::vector<std::string> arguments{"--start",
                                         std::to_string(start_.time_since_epoch().count())};
      const Interval* const active = i == kFace        ? &scene_.face
                                     : i == kObject    ? &scene_.object
                                     : i == kCollision ? &scene_.collision
                                                       : nullptr;
      if (active != nullptr) {
        arguments.insert(arguments.end(), {"--active", std::to_string(active->from) + "-" +
                                                           std::to_string(active->to)});
      }
      processes.start_component(component_program(kSenders[i].program), arguments);
    }
  }

  // Until the scene is over, or a signal says so; then which.
  std::optional<int> watch(Processes& processes) {
    const ViewOptions options{scene_.seconds, title(), is_papers_model_};
    const auto view = lines_ ? make_lines(options) : make_picture(options);
    double next_frame = 0;
    for (;;) {
      const double now = seconds();
      if (now >= scene_.seconds) return {};
      if (now >= next_frame) {
        processes.check_all_run();
        view->tick(story_, now);
        next_frame = now + kFrame;
      }
      const int wait_ms = static_cast<int>((next_frame - now) * 1000) + 1;
      processes.listen(
          signals_.descriptor(), wait_ms,
          [&](std::size_t component, std::string_view line) { heard(*view, component, line); });
      if (const auto signal = signals_.caught()) return signal;
    }
  }

  void heard(View& view, std::size_t component, std::string_view line) {
    if (component >= kReceivers.size()) {
      story_.sender_said(component - kReceivers.size(), line, seconds());
    } else if (story_.receiver_said(component, line, seconds())) {
      view.changed(story_, component);
    }
  }

  [[nodiscard]] std::string title() const {
    return is_papers_model_ ? "Search and Track" : model_.filename().string();
  }

  Signals signals_;
  fs::path model_;
  bool is_papers_model_;
  bool lines_;
  Scene scene_;
  Clock::time_point start_;
  Story story_;
};

int run(int argc, char** argv) {
  CLI::App app("Runs the paper's Search and Track with real processes, and shows who wins",
               "search-and-track-demo");
  app.footer(
      "Example:\n  search-and-track-demo --seconds 60\n\n"
      "Without a terminal it prints a line for each change of winner.\n\n"
      "Exit codes: 0 the winners were those of the paper's model, in its order, or the model is "
      "another;\n"
      "1 they were not, or an error; 2 wrong use");
  Options options;
  app.add_option("--seconds", options.seconds, "How long the scene lasts")
      ->capture_default_str()
      ->check(seconds_between(kLeastSeconds, 3600.0));
  app.add_option("--model", options.model, "Another model for the same components")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  app.add_flag("--lines", options.lines, "Print lines in a terminal too");
  return parse_and_run(app, argc, argv, [&] { return Demo(options).run(); });
}

}  // namespace
}  // namespace search_and_track

int main(int argc, char** argv) {
  return search_and_track::exit_code_of("search-and-track-demo",
                                        [&] { return search_and_track::run(argc, argv); });
}
