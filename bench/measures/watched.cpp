// What `arbiter top` costs those whom it watches.
#include <pty.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "bench/harness/batches.hpp"
#include "bench/harness/robot.hpp"
#include "bench/measures/measures.hpp"

namespace arbiter::bench {
namespace {

constexpr int kPorts = 16;
constexpr int kSensed = 8;

using Payload = std::array<std::byte, 64>;

std::string input(int number) { return "/in" + std::to_string(number) + ":i"; }
std::string output(int number) { return "/out" + std::to_string(number) + ":o"; }

// `arbiter top` in a terminal of its own, which somebody reads. Runs only while it is wanted.
class Top {
 public:
  explicit Top(const Robot& robot) {
    winsize size{};
    size.ws_row = 60;
    size.ws_col = 200;
    const std::string program = program_directory() + "/arbiter";
    int terminal = -1;
    pid_ = ::forkpty(&terminal, nullptr, nullptr, &size);
    if (pid_ < 0) throw BenchError("no terminal for arbiter top");
    if (pid_ == 0) {
      ::setenv("TERM", "xterm-256color", 1);
      ::setenv("XDG_RUNTIME_DIR", robot.runtime_directory().c_str(), 1);
      ::execl(program.c_str(), "arbiter", "top", "--instance", Robot::kInstance, nullptr);
      ::_exit(127);
    }
    reader_ = std::thread([this, terminal = shm::FileDescriptor(terminal)] {
      std::array<char, 65536> text{};
      for (ssize_t got = 0; (got = ::read(terminal.get(), text.data(), text.size())) > 0;) {
        drawn_ += static_cast<std::uint64_t>(got);
      }
    });
  }
  Top(const Top&) = delete;
  Top& operator=(const Top&) = delete;
  ~Top() {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    reader_.join();  // with its program the terminal has ended
  }

  void run(bool wanted) const { ::kill(pid_, wanted ? SIGCONT : SIGSTOP); }
  // Bytes, since it was started.
  [[nodiscard]] std::uint64_t drawn() const { return drawn_; }

 private:
  pid_t pid_ = -1;
  std::atomic<std::uint64_t> drawn_ = 0;
  std::thread reader_;
};

class Publisher {
 public:
  explicit Publisher(std::shared_ptr<Robot> robot)
      : robot_(std::move(robot)), node_(robot_->node("publisher")) {
    for (int i = 0; i < kPorts; ++i) outputs_.push_back(node_.output_port<Payload>(output(i)));
  }

  void operator()() {
    keep(outputs_[next_].publish(payload_));
    next_ = (next_ + 1) % outputs_.size();
  }

 private:
  std::shared_ptr<Robot> robot_;
  Node node_;
  std::vector<OutputPort<Payload>> outputs_;
  std::size_t next_ = 0;
  Payload payload_{};
};

std::shared_ptr<Robot> robot_of_many() {
  std::string behaviours;
  for (int i = 0; i < kPorts; ++i) behaviours += behaviour(output(i), input(i), kSensed);
  return std::make_shared<Robot>(model(behaviours));
}

// Each of its publications is timed by itself, so that its p99 is that of a call.
Contender publisher(const std::string& system, bool watched) {
  auto robot = robot_of_many();
  auto receivers = std::make_shared<Worker>(system + ", receivers", [=](Conversation& with) {
    Node node = robot->node("receivers");
    std::vector<InputPort<Payload>> inputs;
    for (int i = 0; i < kPorts; ++i) inputs.push_back(node.input_port<Payload>(input(i)));
    with.say(1);
    for (std::uint64_t word = 0; with.hear_or_end(word);) {
    }
  });
  receivers->hear();
  Contender one = in_batches(system, Role::kOurs, 1, [=] {
    return [it = std::make_shared<Publisher>(robot)] { (*it)(); };
  });
  if (!watched) {
    one.round = [robot, receivers, round = std::move(one.round)](double seconds) {
      return round(seconds);
    };
    return one;
  }
  auto top = std::make_shared<Worker>(system + ", arbiter top", [=](Conversation& with) {
    const Top watching(*robot);
    for (std::uint64_t wanted = 0; with.hear_or_end(wanted);) {
      watching.run(wanted != 0);
      with.say(watching.drawn());
    }
  });
  one.round = [robot, receivers, top, round = std::move(one.round)](double seconds) {
    top->say(1);
    const std::uint64_t before = top->hear();
    Histogram each = round(seconds);
    top->say(0);
    if (top->hear() == before) throw BenchError("arbiter top has drawn nothing meanwhile");
    return each;
  };
  return one;
}

}  // namespace

Measure measure_watched(const Effort& effort) {
  Measure measure{
      "watched", "publish(), watched",
      "What a call costs its caller while `arbiter top` watches the robot, in a terminal "
      "of 200 by 60: 16 ports, each rule reads 8 activities, the publisher never pauses. "
      "Each call is timed by itself, the clock's reading included."};
  Case one{"16 ports"};
  std::vector<Contender> contenders;
  contenders.push_back(publisher(kUnwatched, false));
  contenders.push_back(publisher(kWatched, true));
  // Long enough for top to draw several times in each.
  one.results = run_rounds(std::move(contenders), {effort.quick ? 3 : 10, 1.0});
  measure.cases.push_back(std::move(one));
  return measure;
}

}  // namespace arbiter::bench
