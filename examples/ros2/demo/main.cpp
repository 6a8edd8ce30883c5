// ros2-demo: nodes with ROS 2's names that know nothing of Arbiter drive a base, which one sees
// move; and beside it what twist_mux would have made of the same commands.
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "command_line.hpp"
#include "found.hpp"
#include "picture.hpp"
#include "processes.hpp"
#include "scene.hpp"
#include "signals.hpp"
#include "terminal.hpp"

namespace ros2_demo {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using search_and_track::Canvas;
using search_and_track::Processes;
using search_and_track::Signals;
using search_and_track::Terminal;

constexpr double kFrame = 1.0 / 12;
constexpr double kToStart = 3;  // seconds, until all have found each other
constexpr int kRows = 23;
constexpr int kColumns = 80;

constexpr const char* kLoopback =
    R"(<General><Interfaces><NetworkInterface name="lo"/></Interfaces>)"
    R"(<AllowMulticast>false</AllowMulticast></General><Discovery>)"
    R"(<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32)"
    R"(</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>)";

// Of the example: where it was installed, or in the sources.
fs::path data_file(const char* name) {
  return search_and_track::first_of({search_and_track::own_directory() / ROS2_DATA_FROM_BIN / name,
                                     fs::path(ROS2_EXAMPLE) / name});
}

struct Options {
  double seconds = kSceneSeconds;
  unsigned domain = 91;
  bool lines = false;
};

class Demo {
 public:
  explicit Demo(const Options& options)
      : pace_(options.seconds / kSceneSeconds), lines_(options.lines || !Terminal::is_there()) {
    setenv("ROS_DOMAIN_ID", std::to_string(options.domain).c_str(), 1);
    setenv("CYCLONEDDS_URI", kLoopback, 1);
  }

  // Returns the exit code.
  int run() {
    std::optional<int> signal;
    {
      Processes processes;
      const fs::path programs = search_and_track::own_directory();
      processes.start_daemon(search_and_track::first_of({programs / "arbiterd"}),
                             data_file("base.xml"));
      start_ = Clock::now() + std::chrono::milliseconds(static_cast<int>(kToStart * 1000));
      start_nodes(processes, search_and_track::first_of(
                                 {programs / "ros2", programs / ROS2_LIBEXEC_FROM_BIN}));
      processes.start_component(search_and_track::first_of({programs / "arbiter-gateway-dds"}),
                                {data_file("ros2.xml")});
      signal = watch(processes);
    }
    if (signal) return 128 + *signal;
    return judge();
  }

 private:
  // Of the scene.
  [[nodiscard]] double now() const {
    return std::chrono::duration<double>(Clock::now() - start_).count() / pace_;
  }
  [[nodiscard]] std::string interval(const Interval& of) const {
    return std::to_string(of.from * pace_) + "-" + std::to_string(of.to * pace_);
  }

  // The bases come first: as listen() numbers them.
  void start_nodes(Processes& processes, const fs::path& nodes) const {
    const std::string start = std::to_string(start_.time_since_epoch().count());
    processes.start_component(nodes / "base", {"rt/cmd_vel"});
    processes.start_component(nodes / "base", {"rt/mux/cmd_vel"});
    processes.start_component(nodes / "mux", {});
    processes.start_component(nodes / "navigation", {start, interval(kNavigates)});
    processes.start_component(nodes / "teleop", {start, interval(kTeleoperates)});
    processes.start_component(nodes / "e_stop", {start, interval(kPressed), interval(kDead)});
  }

  std::optional<int> watch(Processes& processes) {
    std::optional<Terminal> terminal;
    if (!lines_) terminal.emplace();
    for (double next_frame = -kToStart;;) {
      if (now() >= kSceneSeconds) return {};
      if (now() >= next_frame) {
        processes.check_all_run();
        if (terminal) show(*terminal);
        next_frame = now() + kFrame / pace_;
      }
      const int wait_ms = static_cast<int>((next_frame - now()) * pace_ * 1000) + 1;
      processes.listen(signals_.descriptor(), wait_ms,
                       [&](std::size_t node, std::string_view line) {
                         if (node < bases_.size()) heard(bases_[node], line);
                       });
      if (const auto signal = signals_.caught()) return signal;
    }
  }

  void heard(Base& base, std::string_view line) const {
    const std::size_t before = base.commands.size();
    base.said(line);
    if (!lines_ || base.commands.size() == before) return;
    std::printf("%5.1f s  %s: %s\n", now(), std::string(base.title).c_str(), base.now.c_str());
  }

  void show(Terminal& terminal) const {
    const Terminal::Size size = terminal.size();
    Canvas canvas(kRows, kColumns);
    draw(canvas, bases_, now());
    Terminal::write(canvas.drawn(size.rows, size.columns, terminal.is_coloured()));
  }

  [[nodiscard]] int judge() const {
    for (const Base& base : bases_) {
      std::cout << '\n' << base.title << ", the base:\n";
      for (const std::string& command : base.commands) std::cout << "  " << command << '\n';
    }
    const bool right = bases_[0].commands == commands_by_arbiter();
    const bool mux_right = bases_[1].commands == commands_by_mux();
    std::cout
        << (right ? "\nThe base behind Arbiter obeyed whom it should, and stood twice: while the "
                    "emergency\nstop was pressed, and while it was dead.\n"
                  : "\nThis is not what the base behind Arbiter should have been told.\n");
    if (right && mux_right) {
      std::cout
          << "The mux was silent then, so that the other base drove on by its last command.\n";
    }
    return right && mux_right ? 0 : 1;
  }

  const double pace_;
  const bool lines_;
  Signals signals_;
  Clock::time_point start_;
  std::array<Base, 2> bases_{{{.title = "Arbiter"}, {.title = "twist_mux"}}};
};

int run(int argc, char** argv) {
  CLI::App app("Nodes with ROS 2's names drive a base through Arbiter, and one through a mux",
               "ros2-demo");
  app.footer(
      "Example:\n  ros2-demo --seconds 30\n\nIt needs no ROS 2.\n\n"
      "Exit codes: 0 both bases got the commands that they should get; 1 they did not, or an "
      "error;\n"
      "2 wrong use");
  Options options;
  app.add_option("--seconds", options.seconds, "How long the scene lasts")
      ->capture_default_str()
      ->check(search_and_track::seconds_between(15.0, 3600.0));
  app.add_option("--domain", options.domain, "The domain of DDS to use")
      ->capture_default_str()
      ->check(CLI::Range(0U, 230U));
  app.add_flag("--lines", options.lines, "Print lines in a terminal too");
  return search_and_track::parse_and_run(app, argc, argv, [&] { return Demo(options).run(); });
}

}  // namespace
}  // namespace ros2_demo

int main(int argc, char** argv) {
  return search_and_track::exit_code_of("ros2-demo", [&] { return ros2_demo::run(argc, argv); });
}
