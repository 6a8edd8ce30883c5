// Each call of the data path, with real ports, to be run under callgrind (check_budget.cpp).
//
// One thread: without a service thread nothing comes between two calls. A call is made through the
// public API as a component makes it, so its own side of it, and the loop, are counted too. Only
// the clock is another: valgrind has no vDSO, so a reading is a system call, whose instructions in
// the kernel do not count, instead of some fifty in the vDSO.
#include <array>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "bench/instructions/counting.hpp"
#include "bench/instructions/scenes.hpp"

namespace arbiter::bench {
namespace {

constexpr int kWarmUp = 3000;           // more than the largest pool has slots
constexpr std::uint32_t kDepth = 1024;  // of queues that are filled to be emptied
constexpr int kTakes = 1000;

struct Payload {
  std::array<char, 64> bytes{};
};

void require(bool is_so, std::string_view what) {
  if (!is_so) throw std::runtime_error("not as it should be: " + std::string(what));
}

class Scenes {
 public:
  Scenes() {
    for (int i = 0; i < kActive; ++i) activities_.push_back(out(active(i)));
    for (int i = 0; i < kIdle; ++i) activities_.push_back(out(idle(i)));
    for (auto& port : activities_) port.signal();
    for (int i = 0; i < kIdle; ++i) activities_[static_cast<std::size_t>(kActive + i)].deactivate();
  }

  void count_publish() {
    for (const int ports : kFanOuts) {
      std::vector<InputPort<Payload>> receivers;
      for (int i = 0; i < ports; ++i) receivers.push_back(in(fan_out_port(ports, i)));
      auto source = out(fan_out_source(ports));
      count_publish("publish, wins at " + std::to_string(ports), source,
                    static_cast<std::uint32_t>(ports));
      if (ports == 1) {
        count_loan("loan and publish, wins at 1", source);
        const auto tap = tap_of(fan_out_source(ports), false);
        count_publish("publish, wins at 1, tapped", source, 1);
        const auto sleeper = tap_of(fan_out_source(ports), true);
        count_publish("publish, wins at 1, tapped by one that may wait", source, 1);
      }
    }
    for (const int ports : kFanOuts) {
      std::vector<InputPort<Payload>> receivers;
      for (int i = 0; i < ports; ++i) receivers.push_back(in(losing_port(ports, i)));
      auto source = out(losing_source(ports));
      count_publish("publish, loses at " + std::to_string(ports) + ", by 8 activities", source, 0);
    }
    {
      auto receiver = in("/loses_by_one/in");
      auto source = out("/loses_by_one");
      count_publish("publish, loses at 1, by 1 activity", source, 0);
      const auto tap = tap_of("/loses_by_one", false);
      count_publish("publish, loses at 1, by 1 activity, tapped", source, 0);
    }
    auto receiver = in("/free/in");
    auto source = out("/free");
    count_publish("publish, no rule", source, 1);
  }

  void count_take() {
    for (const int sources : kFanIns) {
      auto receiver = in(fan_in_port(sources), kDepth);
      std::vector<OutputPort<Payload>> publishers;
      for (int i = 0; i < sources; ++i) publishers.push_back(out(fan_in_source(sources, i)));
      node_.service();
      const std::string of = " of " + std::to_string(sources);
      count_after(kWarmUp, "take, nothing there" + of, kTimes,
                  [&] { require(!receiver.take(), "nothing to take"); });
      const auto fill = [&] {
        for (int i = 0; i < kTakes + kDrained; ++i) {
          require(publishers[0].publish(Payload()).delivered == 1, "delivered");
        }
      };
      fill();
      const auto take = [&] { require(receiver.take().has_value(), "a sample to take"); };
      count_after(kDrained, "take, a sample" + of, kTakes, take);
    }
  }

 private:
  static constexpr int kDrained = 10;

  OutputPort<Payload> out(const std::string& name) { return node_.output_port<Payload>(name); }
  InputPort<Payload> in(const std::string& name, std::uint32_t depth = 8) {
    return node_.input_port<Payload>(name, {.depth = depth});
  }

  Tap<> tap_of(const std::string& name, bool may_wait) {
    return node_.tap(name, {.max_held = 1, .may_wait = may_wait});
  }

  void count_publish(const std::string& measure, OutputPort<Payload>& source,
                     std::uint32_t delivered) {
    node_.service();
    const Payload payload;
    Outcome outcome;
    count_after(kWarmUp, measure, kTimes, [&] { outcome = source.publish(payload); });
    require(outcome.delivered == delivered, measure);
  }
  void count_loan(const std::string& measure, OutputPort<Payload>& source) {
    Outcome outcome;
    count_after(kWarmUp, measure, kTimes, [&] {
      auto loan = source.loan();
      if (loan) outcome = source.publish(std::move(*loan));
    });
    require(outcome.delivered == 1, measure);
  }

  static NodeOptions options() {
    NodeOptions options;
    options.service_thread = false;
    return options;
  }

  Node node_{"instructions", options()};
  std::vector<OutputPort<Payload>> activities_;
};

}  // namespace
}  // namespace arbiter::bench

int main() {
  try {
    arbiter::bench::Scenes scenes;
    scenes.count_publish();
    scenes.count_take();
    arbiter::bench::count_decisions();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "instruction_operations: %s\n", error.what());
    return 1;
  }
  return 0;
}
