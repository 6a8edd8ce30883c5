// arbiter-bench: what arbitration costs on this machine, beside what one would use instead.
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iostream>

#include <CLI/CLI.hpp>

#include "bench/harness/cpu.hpp"
#include "bench/harness/program.hpp"
#include "bench/measures/measures.hpp"
#include "bench/targets.hpp"

namespace arbiter::bench {
namespace {

struct Arguments {
  bool quick = false;
  std::vector<std::string> only;
  std::string json = "report.json";
};

void print(const Measure& measure) {
  std::cout << "\n" << measure.title << "\n";
  for (const Case& each : measure.cases) {
    std::cout << "  " << each.name << "\n";
    for (const Result& result : each.results) {
      char line[160];
      if (result.value) {
        std::snprintf(line, sizeof line, "    %-34s %14.4g %s", result.system.c_str(),
                      *result.value, measure.unit.c_str());
      } else if (result.ns.count() != 0) {
        std::snprintf(line, sizeof line, "    %-34s p50 %9.1f  p99 %9.1f  p99.9 %9.1f  max %11.1f",
                      result.system.c_str(), result.ns.quantile(0.5), result.ns.quantile(0.99),
                      result.ns.quantile(0.999), result.ns.max());
      } else {
        std::snprintf(line, sizeof line, "    %-34s", result.system.c_str());
      }
      std::cout << line << (result.note.empty() ? "" : "  " + result.note) << "\n";
    }
  }
  std::cout << std::flush;
}

int run(const Arguments& arguments) {
  Report report;
  report.quick = arguments.quick;
  processors();  // as they are now, before anything is pinned
  for (const MeasureEntry& entry : all_measures()) {
    const auto& only = arguments.only;
    if (!only.empty() && std::find(only.begin(), only.end(), entry.name) == only.end()) continue;
    report.measures.push_back(entry.run({arguments.quick}));
    print(report.measures.back());
  }
  report.targets = judge(report);
  std::ofstream(arguments.json) << report.json().dump(1) << "\n";
  return 0;
}

}  // namespace
}  // namespace arbiter::bench

int main(int argc, char** argv) {
  CLI::App app("arbiter-bench: what arbitration costs here, beside what one would use instead");
  arbiter::bench::Arguments arguments;
  app.add_flag("--quick", arguments.quick, "About a minute, in place of about ten");
  app.add_option("--only", arguments.only, "Measure these only")->type_name("NAME");
  app.add_option("--json", arguments.json, "Where the report is written")->type_name("FILE");
  CLI11_PARSE(app, argc, argv);
  return arbiter::bench::run_and_clear_up([&] {
    try {
      return arbiter::bench::run(arguments);
    } catch (const std::exception& error) {
      std::cerr << "arbiter-bench: " << error.what() << "\n";
      return 1;
    }
  });
}
