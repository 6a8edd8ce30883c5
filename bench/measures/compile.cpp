// Reading, proving and compiling models of 10 to 10 000 behaviours, as arbiterd and `arbiter check`
// do.
#include "rules/prove/compile.hpp"

#include <algorithm>
#include <fstream>
#include <unordered_map>

#include "bench/harness/cpu.hpp"
#include "bench/harness/program.hpp"
#include "bench/harness/worker.hpp"
#include "bench/measures/measures.hpp"
#include "rules/model/load.hpp"
#include "rules/prove/flatten.hpp"

namespace arbiter::bench {
namespace {

constexpr int kPerPort = 10;        // behaviours
constexpr int kSourcesPerPort = 4;  // of which 1000 ports make 4000 connections, of 4096

// Ten behaviours to a port: each drives it from one of four sources, in a mode of its own, and
// inhibits those that drive it from a lower one.
std::string model_of(int behaviours) {
  std::string text = "<behaviors>\n";
  for (int i = 0; i < behaviours; ++i) {
    const int port = i / kPerPort;
    const int place = i % kPerPort;
    const std::string at = "/port" + std::to_string(port) + ":i";
    const std::string source =
        "/" + std::to_string(port) + "/source" + std::to_string(place % kSourcesPerPort) + ":o";
    std::string inhibited;
    for (int other = port * kPerPort; other < std::min((port + 1) * kPerPort, behaviours);
         ++other) {
      if (other % kPerPort % kSourcesPerPort >= place % kSourcesPerPort) continue;
      inhibited += (inhibited.empty() ? "B" : ", B") + std::to_string(other);
    }
    text += "<behavior name=\"B" + std::to_string(i) + "\"><config at=\"" + at + "\">" + source +
            "</config><condition>/mode" + std::to_string(place) +
            ":o and not /stop:o</condition><inhibition>" + inhibited + "</inhibition></behavior>\n";
  }
  return text + "</behaviors>\n";
}

// Numbers for names, as the daemon's directory gives them.
template <class Id>
class Numbers {
 public:
  Id of(const std::string& name) {
    return ids_.try_emplace(name, static_cast<Id>(ids_.size())).first->second;
  }

 private:
  std::unordered_map<std::string, Id> ids_;
};

void compile_once(const std::string& file) {
  rules::Diagnostics diagnostics;
  const rules::RuleSet rules = rules::load({{file}, {}}, diagnostics);
  if (diagnostics.has_errors()) throw BenchError("the model has errors");
  const rules::CompiledModel compiled = rules::compile(rules, diagnostics);
  if (diagnostics.has_errors()) throw BenchError("the model has errors");
  Numbers<shm::SourceId> sources;
  Numbers<shm::PortId> ports;
  keep(rules::flatten(compiled, {[&](const std::string& name) { return sources.of(name); },
                                 [&](const std::string& name) { return ports.of(name); }}));
}

Histogram compile(const std::string& file, double seconds) {
  Worker worker("compiler", [&](Conversation& with) {
    Histogram times;
    const std::int64_t begin = now_ns();
    do {
      const std::int64_t before = now_ns();
      compile_once(file);
      times.add(static_cast<double>(now_ns() - before));
    } while (static_cast<double>(now_ns() - begin) < seconds * 1e9);
    with.say(times);
  });
  return worker.hear_histogram();
}

}  // namespace

Measure measure_compile(const Effort& effort) {
  Measure measure{
      "compile", "Compiling a model",
      "A model file read, checked, proved and compiled to a decision table, as arbiterd "
      "does at a reload. Ten behaviours to an input port, from four sources, in ten modes, "
      "inhibiting each other."};
  measure.x_label = "behaviours";
  const ScratchDirectory directory;
  for (const int behaviours : {10, 100, 1000, 10'000}) {
    const std::string file = directory.path() + "/model.xml";
    std::ofstream(file) << model_of(behaviours);
    Case one{std::to_string(behaviours) + " behaviours"};
    one.x = behaviours;
    one.results = run_rounds(
        {{"arbiter", Role::kOurs, [&](double seconds) { return compile(file, seconds); }}},
        effort.quick ? Budget{2, 0.1} : Budget{5, 1});
    measure.cases.push_back(std::move(one));
  }
  return measure;
}

}  // namespace arbiter::bench
