// hosts-demo: Search and Track on two hosts. The cable between them is pulled, the arm rests, and
// the cable is put back.
#include <signal.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>

#include "actors.hpp"
#include "cast.hpp"
#include "command_line.hpp"
#include "found.hpp"
#include "network.hpp"
#include "picture.hpp"
#include "signals.hpp"
#include "terminal.hpp"

namespace hosts_demo {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using search_and_track::Canvas;
using search_and_track::first_of;
using search_and_track::own_directory;
using search_and_track::Signals;
using search_and_track::Terminal;

constexpr double kFrame = 1.0 / 12;
constexpr double kToStart = 2;  // seconds, until all have found each other
constexpr auto kPause = std::chrono::milliseconds(1500);  // before what died is started again
constexpr double kLongestEnd = 30;  // seconds, for who was killed to be there again

struct Options {
  double seconds = kSceneSeconds;
  unsigned domain = 92;
  bool lines = false;
  bool loopback = false;
};

// What the script does, and says.
struct Step {
  double at;
  const char* caption;
  enum class What { nothing, pull, put_back, kill, revive } what;
};
constexpr std::array<Step, 8> kScript{{
    {-kToStart, "Nothing is in sight: the gaze looks around, the arm rests.", Step::What::nothing},
    {kFace.from, "The head sees a face: it draws the gaze, over the cable.", Step::What::nothing},
    {kObject.from, "The head sees an object: it takes the gaze and the arm.", Step::What::nothing},
    {kCable.from, "The cable is pulled: after T (0.5 s) the arm rests.", Step::What::pull},
    {kCable.to, "The cable is put back: the object commands again.", Step::What::put_back},
    {kLink.from, "The head's link is killed: silence again, and the arm rests.", Step::What::kill},
    {kLink.to, "It is started again, and the object commands again.", Step::What::revive},
    {kObject.to, "The object is gone: the arm rests.", Step::What::nothing},
}};

class Demo {
 public:
  explicit Demo(const Options& options)
      : network_(!options.loopback),
        pace_(options.seconds / kSceneSeconds),
        domain_(options.domain),
        is_network_(network_.obstacle().empty()),
        lines_(options.lines || !Terminal::is_there()) {
    state_.network = is_network_ ? "two networks, a cable" : "loopback: no cable";
    if (!is_network_) {
      std::cerr << "hosts-demo: the hosts have no networks of their own (" << network_.obstacle()
                << "): both use the loopback interface, and to pull the cable stops a link\n";
    }
  }

  // Returns the exit code.
  int run() {
    start_ = Clock::now() + std::chrono::milliseconds(static_cast<int>(kToStart * 1000));
    std::optional<int> signal;
    {
      Actors actors(commands());
      signal = watch(actors);
    }
    if (signal) return 128 + *signal;
    return judge();
  }

 private:
  // Of the scene.
  [[nodiscard]] double now() const {
    return std::chrono::duration<double>(Clock::now() - start_).count() / pace_;
  }

  [[nodiscard]] std::array<std::vector<std::string>, kParts.size()> commands() const {
    std::array<std::vector<std::string>, kParts.size()> result;
    for (std::size_t part = 0; part < kParts.size(); ++part) result[part] = command_of(part);
    return result;
  }
  [[nodiscard]] std::vector<std::string> command_of(std::size_t part) const {
    const Part& its = kParts[part];
    std::vector<std::string> command;
    if (is_network_) command = network_.enter(its.host);
    const fs::path programs = own_directory();
    const std::string program(its.program);
    switch (its.role) {
      case Role::daemon:
        command.push_back(first_of({programs / program}));
        command.insert(
            command.end(),
            {"--model", first_of({fs::path(HOSTS_DEMO_MODEL),
                                  programs / HOSTS_DEMO_DATA_FROM_BIN / "search_and_track.xml"})});
        break;
      case Role::link:
        command.push_back(first_of({programs / program}));
        command.insert(command.end(), {"--host", kHostNames[its.host]});
        if (is_network_) {
          command.insert(command.end(), {"--interface", "eth0"});
        } else {
          command.insert(command.end(), {"--domain", std::to_string(domain_)});
        }
        break;
      default:
        command.push_back(first_of({programs / "search-and-track" / program,
                                    programs / HOSTS_DEMO_LIBEXEC_FROM_BIN / program}));
        break;
    }
    if (program.find("detector") != std::string::npos) {
      command.insert(command.end(), {"--start", std::to_string(start_.time_since_epoch().count()),
                                     "--active", active(program)});
    }
    return command;
  }
  // Of the robot's world. Nothing collides: see the other demo.
  [[nodiscard]] std::string active(const std::string& program) const {
    Interval when{1e6, 1e6 + 1};
    if (program == "face-detector") when = {kFace.from * pace_, kFace.to * pace_};
    if (program == "object-detector") when = {kObject.from * pace_, kObject.to * pace_};
    return std::to_string(when.from) + "-" + std::to_string(when.to);
  }

  std::optional<int> watch(Actors& actors) {
    std::optional<Terminal> terminal;
    if (!lines_) terminal.emplace();
    for (double next_frame = -kToStart;;) {
      play(actors);
      if (now() >= next_frame) {
        for (std::size_t part = 0; part < kParts.size(); ++part) note_life(part, actors.pid(part));
        if (terminal) show(*terminal);
        if (is_over()) return {};
        next_frame = now() + kFrame / pace_;
      }
      const int wait_ms = std::max(static_cast<int>((next_frame - now()) * pace_ * 1000), 0) + 1;
      actors.listen(signals_.descriptor(), wait_ms, kPause,
                    [&](std::size_t part, std::string_view line) { heard(part, line); });
      if (const auto signal = signals_.caught()) return signal;
    }
  }

  // Whoever was killed at the end of the scene is waited for: on a busy machine it takes a while to
  // come back, and the arm is judged by what it obeys then.
  [[nodiscard]] bool is_over() const {
    if (now() < kSceneSeconds) return false;
    const bool are_all_there = std::all_of(state_.parts.begin(), state_.parts.end(),
                                           [](const PartState& its) { return its.pid > 0; });
    const Reigns& arm = state_.reigns[kArm];
    const bool rests = !arm.empty() && arm.back().source == kRestPort;
    return (are_all_there && rests) || now() >= kSceneSeconds + kLongestEnd / pace_;
  }

  void play(Actors& actors) {
    while (next_step_ < kScript.size() && now() >= kScript[next_step_].at) {
      const Step& step = kScript[next_step_++];
      state_.caption = step.caption;
      say(step.caption);
      switch (step.what) {
        case Step::What::pull:
          is_network_ ? network_.pull() : actors.signal(kHeadsLink, SIGSTOP);
          state_.is_plugged = false;
          break;
        case Step::What::put_back:
          is_network_ ? network_.put_back() : actors.signal(kHeadsLink, SIGCONT);
          state_.is_plugged = true;
          break;
        case Step::What::kill:
          actors.keep_dead(kHeadsLink, true);
          actors.signal(kHeadsLink, SIGKILL);
          break;
        case Step::What::revive:
          actors.keep_dead(kHeadsLink, false);
          break;
        case Step::What::nothing:
          break;
      }
    }
  }

  void say(const std::string& text) const {
    if (lines_) std::cout << time_text() << text << std::endl;
  }
  [[nodiscard]] std::string time_text() const {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%5.1f s  ", std::max(now(), 0.0));
    return text.data();
  }

  void note_life(std::size_t part, pid_t pid) {
    PartState& its = state_.parts[part];
    const pid_t before = std::exchange(its.pid, pid);
    const bool has_changed = before != pid && now() > 0;
    if (!has_changed) return;
    its.said.clear();
    const std::string name =
        std::string(kHostNames[kParts[part].host]) + ": " + std::string(kParts[part].program);
    if (pid < 0 || before > 0) say(name + " is dead");
    if (pid > 0) say(name + " is there again");
  }

  void heard(std::size_t part, std::string_view line) {
    const Part& its = kParts[part];
    if (its.role == Role::sender || its.role == Role::link) {
      constexpr std::string_view kName = "arbiter-link: ";
      if (line.substr(0, kName.size()) == kName) line.remove_prefix(kName.size());
      state_.parts[part].said = line;
    }
    if (its.role != Role::motor) return;
    const std::string source(line == "idle" ? "" : line.substr(0, line.find(' ')));
    Reigns& reigns = state_.reigns[part];
    if (!reigns.empty() && reigns.back().source == source) return;
    reigns.push_back({now(), source});
    say(std::string(its.port) + "  " + (source.empty() ? "idle" : source));
  }

  void show(Terminal& terminal) const {
    const Terminal::Size size = terminal.size();
    Canvas canvas(kRows, kColumns);
    draw(canvas, state_, now(), kSceneSeconds);
    Terminal::write(canvas.drawn(size.rows, size.columns, terminal.is_coloured()));
  }

  [[nodiscard]] int judge() const {
    std::cout << "\nWho commanded the arm:\n";
    for (const Reign& reign : state_.reigns[kArm]) {
      std::printf("%6.1f s  %s\n", std::max(reign.since, 0.0),
                  reign.source.empty() ? "idle" : reign.source.c_str());
    }
    std::fflush(stdout);
    const bool is_right = is_as_the_page_says(state_.reigns[kArm], pace_);
    std::cout << (is_right
                      ? "\nWhile the cable was out, and while the head's link was dead, the arm "
                        "rested;\notherwise it obeyed the object, as long as there was one.\n"
                      : "\nThis is not what the page says.\n");
    return is_right ? 0 : 1;
  }

  const Network network_;  // before anything has a thread
  const double pace_;
  const unsigned domain_;
  const bool is_network_;
  const bool lines_;
  Signals signals_;
  Clock::time_point start_;
  State state_;
  std::size_t next_step_ = 0;
};

int run(int argc, char** argv) {
  CLI::App app("The paper's robot on two hosts, whose cable is pulled and put back", "hosts-demo");
  app.footer(
      "Example:\n  hosts-demo --seconds 60\n\n"
      "If you are not root, the hosts have networks of their own only where the machine allows "
      "user\n"
      "namespaces; elsewhere both use the loopback interface.\n\n"
      "Exit codes: 0 the arm obeyed those that it should obey; 1 it did not, or an error; 2 wrong "
      "use");
  Options options;
  app.add_option("--seconds", options.seconds, "How long the scene lasts")
      ->capture_default_str()
      ->check(search_and_track::seconds_between(20.0, 3600.0));
  app.add_flag("--loopback", options.loopback, "No networks of their own for the hosts");
  app.add_option("--domain", options.domain, "The domain of DDS to use on the loopback interface")
      ->capture_default_str()
      ->check(CLI::Range(0U, 230U));
  app.add_flag("--lines", options.lines, "Print lines in a terminal too");
  return search_and_track::parse_and_run(app, argc, argv, [&] { return Demo(options).run(); });
}

}  // namespace
}  // namespace hosts_demo

int main(int argc, char** argv) {
  return search_and_track::exit_code_of("hosts-demo", [&] { return hosts_demo::run(argc, argv); });
}
