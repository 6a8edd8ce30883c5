// What publish() costs its caller: a loser's, a winner's, and by the number of input ports.
#include <array>
#include <memory>
#include <vector>

#include "bench/harness/batches.hpp"
#include "bench/harness/robot.hpp"
#include "bench/measures/measures.hpp"
#include "bench/peers/systems.hpp"

namespace arbiter::bench {
namespace {

constexpr int kBatch = 16;

using Payload = std::array<std::byte, 64>;

std::string port(int number) { return "/in" + std::to_string(number) + ":i"; }

// One publisher, so many input ports that do not take, and a rule at each that reads so many
// activities.
struct Set {
  int ports;
  int sensed;
  bool loses;           // the last of the activities is there, and says no
  bool tapped = false;  // by the receivers' process, which does not look
};

std::string model_of(const Set& set) {
  std::string behaviours;
  for (int i = 0; i < set.ports; ++i) behaviours += behaviour("/out:o", port(i), set.sensed);
  return model(behaviours, "3600s");
}

class Publisher {
 public:
  Publisher(std::shared_ptr<Robot> robot, const Set& set)
      : robot_(std::move(robot)),
        node_(robot_->node("publisher")),
        output_(node_.output_port<Payload>("/out:o")) {
    if (!set.loses) return;
    other_.emplace(node_.output_port<std::uint64_t>("/sensed" + std::to_string(set.sensed) + ":o"));
    other_->signal();
  }

  void operator()() { keep(output_.publish(payload_)); }

 private:
  std::shared_ptr<Robot> robot_;
  Node node_;
  OutputPort<Payload> output_;
  std::optional<OutputPort<std::uint64_t>> other_;
  Payload payload_{};
};

// The receivers' process, and the publisher's.
Contender publisher(const std::string& system, const Set& set) {
  auto robot = std::make_shared<Robot>(model_of(set));
  auto receivers = std::make_shared<Worker>(system + ", receivers", [=](Conversation& with) {
    Node node = robot->node("receivers");
    std::vector<InputPort<Payload>> inputs;
    for (int i = 0; i < set.ports; ++i) inputs.push_back(node.input_port<Payload>(port(i)));
    TapOptions polls;
    polls.may_wait = false;
    std::optional<Tap<Payload>> tap;
    if (set.tapped) tap.emplace(node.tap<Payload>("/out:o", polls));
    with.say(1);
    for (std::uint64_t word = 0; with.hear_or_end(word);) {
    }
  });
  receivers->hear();
  Contender one = in_batches(system, Role::kOurs, kBatch, [=] {
    return [it = std::make_shared<Publisher>(robot, set)] { (*it)(); };
  });
  one.round = [receivers, round = std::move(one.round)](double seconds) { return round(seconds); };
  return one;
}

Contender clock_read() {
  return in_batches(kClockRead, Role::kFloor, kBatch, [] { return [] { keep(now_ns()); }; });
}

}  // namespace

Measure measure_publish(const Effort& effort) {
  Measure measure{
      "publish", "publish()",
      "What a call costs its caller, by a copy of 64 bytes; the receivers are in another "
      "process and take nothing. Mean of batches of 16."};
  measure.x_label = "input ports";
  for (const int ports : {1, 8, 64}) {
    Case one{std::to_string(ports) + (ports == 1 ? " input port" : " input ports")};
    one.x = ports;
    std::vector<Contender> contenders;
    contenders.push_back(clock_read());
    if (ports == 1) {
      contenders.push_back(publisher("loses, 1 activity", {ports, 1, true}));
      contenders.push_back(publisher("wins, no rule to decide", {ports, 0, false}));
    }
    contenders.push_back(publisher("loses, 8 activities", {ports, 8, true}));
    contenders.push_back(publisher("wins, 8 activities", {ports, 8, false}));
    if (ports == 1) {
      contenders.push_back(publisher("loses, 8 activities, tapped", {ports, 8, true, true}));
      contenders.push_back(publisher("wins, 8 activities, tapped", {ports, 8, false, true}));
    }
    std::vector<Result> absent_ones;
    try {
      contenders.push_back(iceoryx_fan_out(ports, kBatch));
    } catch (const std::exception& error) {
      absent_ones.push_back(absent(kIceoryx, Role::kPeer, error.what()));
    }
    one.results = run_rounds(std::move(contenders), effort.budget());
    one.results.insert(one.results.end(), absent_ones.begin(), absent_ones.end());
    measure.cases.push_back(std::move(one));
  }
  return measure;
}

}  // namespace arbiter::bench
