// arbiter top: a live view of a running instance, in the terminal.
//
// This thread has the terminal, and looks at what decides, in memory. What only the daemon knows is
// asked for on another one (top/inquirer.hpp).
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <stop_token>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>

#include "cli/live.hpp"
#include "cli/numbers.hpp"
#include "cli/verbs.hpp"
#include "cli/why_answer.hpp"
#include "shm/clock.hpp"
#include "top/inquirer.hpp"
#include "top/keys.hpp"
#include "top/overlay.hpp"
#include "top/sampler.hpp"
#include "top/screen.hpp"
#include "top/tapper.hpp"
#include "top/view.hpp"
#include "watch/model_loader.hpp"

namespace arbiter::cli {
namespace {

constexpr shm::Nanoseconds kOneSecond = 1'000'000'000;
// How far one can step back, in time and in pictures.
constexpr shm::Nanoseconds kKept = 60 * kOneSecond;
constexpr shm::Nanoseconds kMostKept = 3000;
constexpr int kCensusesForRates = 2;

struct TopOptions {
  std::string instance;
  shm::Nanoseconds interval = kOneSecond / 10;
  bool once = false;
};

watch::KeptPicture picture_of(const top::Frame& frame) {
  watch::KeptPicture picture;
  picture.generation = frame.generation;
  picture.now = frame.now;
  picture.is_settled = frame.is_settled;
  for (std::size_t i = 0; i < frame.words.size(); ++i) {
    picture.words[frame.census->sources[i].name] = frame.words[i];
  }
  return picture;
}

std::string explain(const std::shared_ptr<watch::Instance>& instance,
                    const std::shared_ptr<watch::ModelLoader>& models,
                    const top::WhyQuestion& question, const std::stop_token& stop) {
  std::optional<watch::KeptPicture> kept;
  if (question.moment != nullptr) kept = picture_of(*question.moment);
  std::ostringstream text;
  for (const std::string& port : question.ports) {
    if (stop.stop_requested()) break;
    if (text.tellp() > 0) text << '\n';
    WhyOptions options;
    options.port = port;
    options.source = question.source;
    write_why(text, options, instance, kept ? &*kept : nullptr, nullptr, models);
  }
  if (kept) {
    text << "\nWho wins, and what is active, is of the moment shown, and \"ago\" counts from it. "
            "Which components have what open, and lines with \"!\", are of now.\n";
  }
  return text.str();
}

class Top {
 public:
  Top(const TopOptions& options, top::Charset charset)
      : interval_(options.interval),
        interrupts_(catch_interrupts()),
        instance_(follow_instance("top", options.instance)),
        tapper_(options.instance),
        sampler_(instance_, [this] { return tapper_.collect(); }),
        inquirer_(follow_instance("top", options.instance), explain),
        view_(charset, static_cast<std::size_t>(
                           std::clamp<shm::Nanoseconds>(kKept / options.interval, 1, kMostKept))) {}

  int watch(top::Screen& screen) {
    while (!view_.is_over() && !screen.is_asked_to_end()) {
      take_news();  // first, so that what is new is in the picture
      const shm::Nanoseconds next_look = sampler_.look();
      for (const std::string& port : tapper_.take_refused()) {
        view_.forget_tap(port);
        asked_to_tap_.erase(port);
      }
      if (shm::monotonic_now() >= next_picture_) {
        view_.add(sampler_.frame(tapper_.tapped(shm::monotonic_now())), sampler_.new_takeovers());
        screen.show(view_.draw(screen.size()));
        next_picture_ = shm::monotonic_now() + interval_;
      }
      bool must_draw = false;
      if (!sleep_until_something(std::min(next_look, next_picture_), screen.signals(), must_draw)) {
        return 0;
      }
      while (const auto press = screen.read_key()) {
        must_draw = true;
        if (auto question = view_.press(*press)) inquirer_.ask(std::move(*question));
        if (asked_to_tap_ != view_.tapped()) tapper_.watch(asked_to_tap_ = view_.tapped());
      }
      if (must_draw) screen.show(view_.draw(screen.size()));
    }
    return 0;
  }

  // Once the daemon has counted for a second, so that there are rates.
  int print_once() {
    while (censuses_ < kCensusesForRates) {
      const shm::Nanoseconds next_look = sampler_.look();
      if (!take_news().empty()) throw wire::CallError(problem_);
      if (sleep_until(next_look, interrupts_)) return interrupted_exit_code(interrupts_);
    }
    sampler_.look();
    view_.add(sampler_.frame(), sampler_.new_takeovers());
    std::cout << view_.text();
    return 0;
  }

 private:
  // Returns why there is none, or "". What somebody waits for is drawn at once, however long the
  // interval: the first picture, the first rates, an answer, a problem.
  const std::string& take_news() {
    top::Inquirer::News news = inquirer_.take_news();
    if (news.census != nullptr) {
      if (++censuses_ <= kCensusesForRates) next_picture_ = 0;
      sampler_.set_census(std::move(news.census));
    }
    if (news.why) {
      view_.set_answer(*news.why);
      next_picture_ = 0;
    }
    problem_ = std::move(news.problem);
    view_.set_silent(news.is_silent);
    const std::string shown = problem_.empty() ? tapper_.problem() : problem_;
    if (shown != shown_problem_) next_picture_ = 0;
    view_.set_problem(shown_problem_ = shown);
    return problem_;
  }

  // False: it is to end, or the terminal has gone.
  [[nodiscard]] bool sleep_until_something(shm::Nanoseconds time, int signals,
                                           bool& has_signal) const {
    pollfd ready[] = {{STDIN_FILENO, POLLIN, 0},
                      {interrupts_.get(), POLLIN, 0},
                      {inquirer_.descriptor(), POLLIN, 0},
                      {instance_->descriptor(), POLLIN, 0},
                      {signals, POLLIN, 0}};
    const shm::Nanoseconds left = std::max<shm::Nanoseconds>(time - shm::monotonic_now(), 0);
    const timespec span{left / kOneSecond, left % kOneSecond};
    if (::ppoll(ready, std::size(ready), &span, nullptr) <= 0) return true;
    has_signal = ready[4].revents != 0;
    return ready[1].revents == 0 && (ready[0].revents & (POLLHUP | POLLERR | POLLNVAL)) == 0;
  }

  const shm::Nanoseconds interval_;
  const shm::FileDescriptor interrupts_;
  const std::shared_ptr<watch::Instance> instance_;
  top::Tapper tapper_;
  top::Sampler sampler_;
  top::Inquirer inquirer_;
  top::View view_;
  std::string problem_;        // of the daemon's
  std::string shown_problem_;  // that, or the taps'
  shm::Nanoseconds next_picture_ = 0;
  std::set<std::string> asked_to_tap_;
  int censuses_ = 0;
};

int top_verb(const TopOptions& options) {
  if (options.once) return Top(options, top::charset_of_locale()).print_once();
  top::require_terminal();
  // Made before the screen: what is wrong with the instance is said on an ordinary terminal.
  Top top(options, top::charset_of_locale());
  top::Screen screen;
  return top.watch(screen);
}

// As ? shows them.
std::string keys_text() {
  std::string text;
  for (const std::string& line : top::key_lines()) {
    for (const std::string& part : top::broken("  " + line, 80, top::Charset::kAscii)) {
      text += part + "\n";
    }
  }
  return text;
}

}  // namespace

void add_top(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<TopOptions>();
  CLI::App* verb = app.add_subcommand(
      "top", "Show who wins, which sources are active and what changes, live, in the terminal");
  verb->add_option_function<std::string>(
          "--interval",
          [options](const std::string& text) {
            options->interval =
                read_time_within("--interval", text, kOneSecond / 50, 60 * kOneSecond);
          },
          "How often the screen changes: 20ms to 60s, by default 100ms")
      ->type_name("DURATION");
  verb->add_flag("--once", options->once,
                 "Print one picture as text, after a second, in which rates are counted");
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Keys:\n" + keys_text() +
      "\nIt changes nothing, and no component notices it unless you tap a port (t).\n"
      "NO_COLOR, TERM and the locale are heeded.\n\n"
      "Example:\n"
      "  arbiter top\n"
      "  arbiter top --once > picture.txt\n\n"
      "Exit codes: 0 done; 1 no daemon, or you may not observe it; 2 wrong use, no terminal "
      "that could\nshow it, or standard output cannot be written; 130 --once was stopped by Ctrl-C "
      "(143 by "
      "SIGTERM)");
  verb->callback([options, &exit_code] {
    try {
      exit_code = top_verb(*options);
    } catch (const top::ScreenError& error) {
      std::cerr << "arbiter: " << error.what() << '\n';
      exit_code = 2;
    }
  });
}

}  // namespace arbiter::cli
