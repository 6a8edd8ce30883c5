// What is measured. Each in a file of its own; main.cpp runs them in this order.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bench/harness/report.hpp"
#include "bench/harness/rounds.hpp"

namespace arbiter::bench {

struct Effort {
  bool quick = false;
  // For measures that run rounds, per contender.
  [[nodiscard]] Budget budget() const { return quick ? Budget{5, 0.04} : Budget{20, 0.1}; }
};

struct MeasureEntry {
  std::string name;
  std::function<Measure(const Effort&)> run;
};

Measure measure_compile(const Effort& effort);
Measure measure_delivery(const Effort& effort);
Measure measure_load(const Effort& effort);
Measure measure_scale(const Effort& effort);
Measure measure_swap(const Effort& effort);
Measure measure_throughput(const Effort& effort);

inline std::vector<MeasureEntry> all_measures() {
  return {
      {"delivery", measure_delivery}, {"throughput", measure_throughput},
      {"swap", measure_swap},         {"load", measure_load},
      {"scale", measure_scale},       {"compile", measure_compile},
  };
}

}  // namespace arbiter::bench
