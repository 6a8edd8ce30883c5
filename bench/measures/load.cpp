// Blocking delivery while all processors are busy, at normal priority and with SCHED_FIFO.
#include <unistd.h>

#include "bench/harness/cpu.hpp"
#include "bench/harness/program.hpp"
#include "bench/measures/measures.hpp"
#include "bench/measures/ping_pong.hpp"
#include "bench/peers/systems.hpp"

namespace arbiter::bench {
namespace {

constexpr int kPriority = 50;
const char* const kStressNg = "/usr/bin/stress-ng";

bool has_stress_ng() { return ::access(kStressNg, X_OK) == 0; }

// All processors busy, for as long as it lives.
class Load {
 public:
  Load() {
    const std::size_t wanted = processors().size();
    if (has_stress_ng()) {
      start({kStressNg, "--quiet", "--cpu", std::to_string(wanted), "--cache",
             std::to_string(wanted)});
      return;
    }
    for (std::size_t i = 0; i < wanted; ++i) start({"/bin/sh", "-c", "while :; do :; done"});
  }

 private:
  void start(const std::vector<std::string>& argv) {
    programs_.emplace_back(argv, Program::Variables{}, directory_.path() + "/log");
  }

  ScratchDirectory directory_;
  std::vector<Program> programs_;
};

Case measure_with(const std::string& name, const Systems& systems, int priority,
                  const Effort& effort) {
  Case one{name};
  std::vector<Result> absent_ones;
  // Set up while the machine is still quiet.
  auto contenders = ping_pongs(systems, {Waiting::kBlocking, 64, {}}, absent_ones, {priority});
  const Load load;
  one.results = run_rounds(std::move(contenders), effort.budget());
  one.results.insert(one.results.end(), absent_ones.begin(), absent_ones.end());
  return one;
}

}  // namespace

Measure measure_load(const Effort& effort) {
  Measure measure{"load", "Delivery under load",
                  std::string("64 B one way, blocking (half of a round trip), while ") +
                      (has_stress_ng() ? "stress-ng (cpu and cache, one of each to a processor)"
                                       : "one endless loop to each processor") +
                      " keeps all processors busy at normal priority. With SCHED_FIFO, the "
                      "threads that send and receive have priority " +
                      std::to_string(kPriority) + "; a system's helper threads have not."};
  const Systems systems = all_systems();
  measure.cases.push_back(measure_with("loaded, normal priority", systems, 0, effort));
  if (may_use_fifo()) {
    measure.cases.push_back(measure_with("loaded, SCHED_FIFO", systems, kPriority, effort));
  } else {
    measure.cases.push_back(
        {"loaded, SCHED_FIFO",
         {},
         {absent(kArbiter, Role::kOurs, "SCHED_FIFO is not permitted to this user here")}});
  }
  return measure;
}

}  // namespace arbiter::bench
