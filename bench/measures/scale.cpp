// A large robot: 64 components, 1000 input ports, 4096 connections.
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "bench/harness/cpu.hpp"
#include "bench/harness/robot.hpp"
#include "bench/harness/worker.hpp"
#include "bench/measures/measures.hpp"
#include "shm/limits.hpp"

namespace arbiter::bench {
namespace {

constexpr int kComponents = 64;
constexpr int kInputs = 1000;
constexpr int kDestinations = shm::kMaxDestinations;  // of the one output port of each component
static_assert(kComponents * kDestinations == shm::kMaxConnections);

using Sample64 = std::array<std::uint64_t, 8>;

std::string output_name(int component) { return "/component" + std::to_string(component) + ":o"; }
std::string input_name(int port) { return "/port" + std::to_string(port) + ":i"; }

// The destinations of the components, one after another, go round the ports; at each port a later
// source overrides the earlier ones.
std::string model_text() {
  std::vector<std::vector<int>> sources(kInputs);
  for (int i = 0; i < kComponents * kDestinations; ++i) {
    sources[static_cast<std::size_t>(i % kInputs)].push_back(i / kDestinations);
  }
  std::string rules;
  for (int port = 0; port < kInputs; ++port) {
    rules += "<arbiter at=\"" + input_name(port) + "\">";
    const auto& here = sources[static_cast<std::size_t>(port)];
    for (std::size_t i = 0; i < here.size(); ++i) {
      std::string rule;
      for (std::size_t other = i + 1; other < here.size(); ++other) {
        rule += (rule.empty() ? "not " : " and not ") + output_name(here[other]);
      }
      rules += "<select from=\"" + output_name(here[i]) + "\">" + rule + "</select>";
    }
    rules += "</arbiter>\n";
  }
  return model(rules);
}

struct Memory {
  std::uint64_t pss_kib = 0;     // its share of what it has mapped
  std::uint64_t shared_kib = 0;  // of which shared memory
};

Memory memory_of(pid_t pid) {
  std::ifstream stream("/proc/" + std::to_string(pid) + "/smaps_rollup");
  Memory memory;
  for (std::string line; std::getline(stream, line);) {
    std::sscanf(line.c_str(), "Pss: %lu kB", &memory.pss_kib);
    std::sscanf(line.c_str(), "Pss_Shmem: %lu kB", &memory.shared_kib);
  }
  return memory;
}

// Opens its ports, says how long each took, and on each word thereafter asks for the status.
void be_component(Conversation& with, const Robot& robot, int component) {
  Node node = robot.node("component" + std::to_string(component));
  with.say(1);
  std::uint64_t word = 0;
  if (!with.hear_or_end(word)) return;
  Histogram each;
  std::int64_t before = now_ns();
  const auto opened = [&] {
    const std::int64_t now = now_ns();
    each.add(static_cast<double>(now - before));
    before = now;
  };
  std::vector<InputPort<Sample64>> inputs;
  for (int port = component; port < kInputs; port += kComponents) {
    inputs.push_back(node.input_port<Sample64>(input_name(port)));
    opened();
  }
  const auto output = node.output_port<Sample64>(output_name(component));
  opened();
  with.say(each);
  while (with.hear_or_end(word)) {
    const std::string command =
        "'" + program_directory() + "/arbiter' status --instance bench --json >/dev/null";
    before = now_ns();
    const int status = std::system(command.c_str());
    if (status != 0) throw BenchError("arbiter status: exit " + std::to_string(status));
    with.say(static_cast<std::uint64_t>(now_ns() - before));
  }
}

Case value_case(std::string name, std::string unit,
                std::vector<std::pair<std::string, double>> values) {
  Case one{std::move(name)};
  one.unit = std::move(unit);
  for (auto& [system, value] : values) {
    one.results.push_back({std::move(system), Role::kOurs, {}, value, {}});
  }
  return one;
}

Histogram status_times(Worker& component, int times) {
  Histogram histogram;
  for (int i = 0; i < times; ++i) {
    component.say(1);
    histogram.add(static_cast<double>(component.hear()));
  }
  return histogram;
}

Case memory_case(const Robot& robot, const std::vector<Worker>& components) {
  const Memory daemon = memory_of(robot.daemon());
  Memory all;
  for (const Worker& each : components) {
    const Memory one = memory_of(each.pid());
    all.pss_kib += one.pss_kib;
    all.shared_kib += one.shared_kib;
  }
  const auto mib = [](std::uint64_t kib) { return static_cast<double>(kib) / 1024; };
  return value_case("memory, each page divided among those that map it", "MiB",
                    {{"arbiterd", mib(daemon.pss_kib)},
                     {"arbiterd: shared memory", mib(daemon.shared_kib)},
                     {"a component", mib(all.pss_kib) / kComponents},
                     {"a component: shared memory", mib(all.shared_kib) / kComponents},
                     {"all together", mib(daemon.pss_kib + all.pss_kib)}});
}

// Whoever left last is seen off: no processor time is used for a moment. One that never rests is
// measured as it is.
void wait_until_idle(pid_t daemon) {
  for (int tries = 0; tries < 20; ++tries) {
    const std::int64_t used = processor_time_ns(daemon);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    if (processor_time_ns(daemon) == used) return;
  }
}

// Nobody publishes meanwhile, and nobody comes or goes.
Case idle_case(const Robot& robot, double seconds) {
  wait_until_idle(robot.daemon());
  const std::int64_t used_before = processor_time_ns(robot.daemon());
  const std::int64_t before = now_ns();
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  const auto used = static_cast<double>(processor_time_ns(robot.daemon()) - used_before);
  return value_case("daemon idle", "% of a processor",
                    {{"arbiterd", 100 * used / static_cast<double>(now_ns() - before)}});
}

}  // namespace

Measure measure_scale(const Effort& effort) {
  Measure measure{
      "scale", "A large robot",
      "64 components, each a process with 15 or 16 input ports and one output port that has 64 "
      "destinations: 1000 input ports and 4096 connections. All open their ports at the same "
      "time."};
  const Robot robot(model_text());
  std::vector<Worker> components;
  for (int i = 0; i < kComponents; ++i) {
    components.emplace_back("component " + std::to_string(i),
                            [&robot, i](Conversation& with) { be_component(with, robot, i); });
  }
  for (Worker& each : components) each.hear();
  Result all{"arbiter: 1000 ports", Role::kOurs, {}, {}, {}};
  Result each_port{"arbiter: each port", Role::kOurs, {}, {}, {}};
  const std::int64_t before = now_ns();
  for (Worker& each : components) each.say(1);
  for (Worker& each : components) each_port.ns.add(each.hear_histogram());
  all.ns.add(static_cast<double>(now_ns() - before));
  Case attach{"attach"};
  attach.results = {std::move(all), std::move(each_port)};
  measure.cases.push_back(std::move(attach));
  measure.cases.push_back(memory_case(robot, components));
  measure.cases.push_back(idle_case(robot, effort.quick ? 2 : 10));
  Case status{"status: `arbiter status --json`, the program's start included"};
  status.results.push_back(
      {"arbiter", Role::kOurs, status_times(components.front(), effort.quick ? 3 : 20), {}, {}});
  measure.cases.push_back(std::move(status));
  return measure;
}

}  // namespace arbiter::bench
