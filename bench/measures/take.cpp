// What take() costs its caller: where nothing waits, by the number of sources.
#include <array>
#include <memory>
#include <vector>

#include "bench/harness/batches.hpp"
#include "bench/harness/robot.hpp"
#include "bench/measures/measures.hpp"

namespace arbiter::bench {
namespace {

using Payload = std::array<std::byte, 64>;

std::string output(int number) { return "/out" + std::to_string(number) + ":o"; }

// Each source overrides those before it: the rule of the first reads all others.
std::string model_of(int sources) {
  std::string behaviours;
  std::string earlier;
  for (int i = 0; i < sources; ++i) {
    const std::string name = "Behaviour " + std::to_string(i);
    behaviours += "<behavior name=\"" + name + "\"><config at=\"/in:i\">" + output(i) +
                  "</config><inhibition>" + earlier + "</inhibition></behavior>\n";
    earlier += (i == 0 ? "" : ", ") + name;
  }
  return model(behaviours, "3600s");
}

Contender empty_take(int sources) {
  const std::string system = "nothing waits";
  auto robot = std::make_shared<Robot>(model_of(sources));
  auto publishers = std::make_shared<Worker>(system + ", publishers", [=](Conversation& with) {
    Node node = robot->node("publishers");
    std::vector<OutputPort<Payload>> outputs;
    for (int i = 0; i < sources; ++i) outputs.push_back(node.output_port<Payload>(output(i)));
    with.say(1);
    for (std::uint64_t word = 0; with.hear_or_end(word);) {
      for (auto& each : outputs) each.signal();  // takes up the receiver, which has come since
      with.say(1);
    }
  });
  publishers->hear();
  Contender one = in_batches(system, Role::kOurs, 64, [=] {
    auto node = std::make_shared<Node>(robot->node("receiver"));
    auto input = std::make_shared<InputPort<Payload>>(node->input_port<Payload>("/in:i"));
    return [node, input] { keep(input->take().has_value()); };
  });
  publishers->say(1);
  publishers->hear();
  one.round = [publishers, round = std::move(one.round)](double seconds) { return round(seconds); };
  return one;
}

}  // namespace

Measure measure_take(const Effort& effort) {
  Measure measure{"take", "take() where nothing waits",
                  "What a look at all queues of an input port costs. Mean of batches of 64."};
  measure.x_label = "sources";
  for (const int sources : {1, 8, 64}) {
    Case one{std::to_string(sources) + (sources == 1 ? " source" : " sources")};
    one.x = sources;
    std::vector<Contender> contenders;
    contenders.push_back(empty_take(sources));
    one.results = run_rounds(std::move(contenders), effort.budget());
    measure.cases.push_back(std::move(one));
  }
  return measure;
}

}  // namespace arbiter::bench
