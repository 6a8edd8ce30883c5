// arbiter-bench: what arbitration costs on this machine, beside what one would use instead.
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iostream>

#include <CLI/CLI.hpp>

#include "bench/harness/cpu.hpp"
#include "bench/harness/html.hpp"
#include "bench/harness/interruption.hpp"
#include "bench/harness/machine.hpp"
#include "bench/harness/picture.hpp"
#include "bench/harness/program.hpp"
#include "bench/harness/rounds.hpp"
#include "bench/measures/measures.hpp"
#include "bench/targets.hpp"
#include "cli/progress.hpp"

namespace arbiter::bench {
namespace {

struct Arguments {
  bool quick = false;
  std::vector<std::string> only;
  std::string json = "report.json";
  std::string html = "report.html";
  std::string picture = "report.svg";
};

constexpr int kWrongUse = 2;
constexpr int kInterrupted = 130;  // as a shell says it

// "-": there are too few samples.
std::string text_of(const Tail& tail, const Histogram& ns) {
  if (!tail.is_known(ns)) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", ns.quantile(tail.share));
  return text;
}

void print(const Measure& measure) {
  std::cout << "\n" << measure.title << "\n";
  for (const Case& each : measure.cases) {
    std::cout << "  " << each.name << "\n";
    for (const Result& result : each.results) {
      char line[160];
      if (result.value) {
        std::snprintf(line, sizeof line, "    %-34s %14.4g %s", result.system.c_str(),
                      *result.value, (each.unit.empty() ? measure.unit : each.unit).c_str());
      } else if (result.ns.count() != 0) {
        std::snprintf(line, sizeof line, "    %-34s p50 %9.1f  p99 %9s  p99.9 %9s  max %11.1f",
                      result.system.c_str(), result.ns.quantile(0.5),
                      text_of(kTail99, result.ns).c_str(), text_of(kTail999, result.ns).c_str(),
                      result.ns.max());
      } else {
        std::snprintf(line, sizeof line, "    %-34s", result.system.c_str());
      }
      std::cout << line << (result.note.empty() ? "" : "  " + result.note) << "\n";
    }
  }
  std::cout << std::flush;
}

void print(const std::vector<Verdict>& targets) {
  if (targets.empty()) return;
  std::cout << "\nTargets\n";
  for (const Verdict& each : targets) {
    char line[160];
    if (each.measured) {
      std::snprintf(line, sizeof line, "%-50s %9.3g of %9.3g %s", each.name.c_str(), *each.measured,
                    each.limit, each.unit.c_str());
    } else {
      std::snprintf(line, sizeof line, "%-50s not measured", each.name.c_str());
    }
    std::cout << (each.is_met()   ? "  met     "
                  : each.measured ? "  MISSED  "
                                  : "          ")
              << line << "\n";
  }
}

// Opened first, so that an error shows before anything is measured. What is there stays until there
// is something in its place: a run may be interrupted.
void require_writable(const std::string& file) {
  if (!std::ofstream(file, std::ios::app)) throw std::runtime_error("cannot write " + file);
}

void write(const std::string& file, const std::string& text) {
  std::ofstream stream(file);
  stream << text;
  if (!stream.flush()) throw std::runtime_error("cannot write " + file);
}

void list() {
  for (const MeasureEntry& entry : all_measures()) std::cout << entry.name << "\n";
}

// Empty where all are known.
std::string first_unknown(const std::vector<std::string>& names) {
  const auto measures = all_measures();
  for (const std::string& name : names) {
    const auto is_it = [&](const MeasureEntry& each) { return each.name == name; };
    if (std::none_of(measures.begin(), measures.end(), is_it)) return name;
  }
  return "";
}

std::vector<MeasureEntry> chosen(const std::vector<std::string>& only) {
  auto measures = all_measures();
  std::erase_if(measures, [&](const MeasureEntry& entry) {
    return !only.empty() && std::find(only.begin(), only.end(), entry.name) == only.end();
  });
  return measures;
}

void run(const Arguments& arguments) {
  for (const std::string& file : {arguments.json, arguments.html, arguments.picture}) {
    require_writable(file);
  }
  Report report;
  report.quick = arguments.quick;
  processors();  // as they are now, before anything is pinned
  const MachineWatch watch;
  const auto measures = chosen(arguments.only);
  for (std::size_t i = 0; i < measures.size(); ++i) {
    throw_if_interrupted();
    const std::string which = std::to_string(i + 1) + " of " + std::to_string(measures.size());
    std::cerr << "measuring " << which << ": " << measures[i].name << "\n";
    cli::ProgressLine progress;
    watch_rounds([&](const Round& round) {
      progress.show([&] {
        return measures[i].name + ": round " + std::to_string(round.number) + " of " +
               std::to_string(round.of) + " (" + round.system + ")";
      });
    });
    report.measures.push_back(measures[i].run({arguments.quick}));
    progress.clear();
    watch_rounds({});
    print(report.measures.back());
  }
  report.machine = watch.finish(report.warnings);
  report.targets = judge(report);
  print(report.targets);
  for (const std::string& warning : report.warnings) std::cout << "\nWarning: " << warning;
  const nlohmann::json json = report.json();
  write(arguments.json, json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  write(arguments.html, html(json));
  write(arguments.picture, picture(json));
  std::cout << "\n\nThe report is in " << arguments.json << " and " << arguments.html
            << ", its targets as a picture in " << arguments.picture << "\n";
}

int run_or_explain(const Arguments& arguments) {
  try {
    run(arguments);
    return 0;
  } catch (const Interrupted&) {
    std::cerr << "\narbiter-bench: interrupted\n";
    return kInterrupted;
  } catch (const std::exception& error) {
    std::cerr << "arbiter-bench: " << error.what() << "\n";
    return 1;
  }
}

}  // namespace
}  // namespace arbiter::bench

int main(int argc, char** argv) {
  using namespace arbiter::bench;
  CLI::App app("arbiter-bench: what arbitration costs here, beside what one would use instead");
  Arguments arguments;
  bool is_full = false;
  bool is_list = false;
  auto* const quick =
      app.add_flag("--quick", arguments.quick, "About two minutes, not about fourteen");
  app.add_flag("--full", is_full, "About fourteen minutes (default)")->excludes(quick);
  app.add_option("--only", arguments.only, "These measures only")
      ->type_name("NAME")
      ->delimiter(',');
  app.add_flag("--list", is_list, "Name the measures, and end");
  app.add_option("--json", arguments.json, "Where the figures are written")->type_name("FILE");
  app.add_option("--html", arguments.html, "Where the page is written")->type_name("FILE");
  app.add_option("--picture", arguments.picture, "Where the targets are drawn, as SVG")
      ->type_name("FILE");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongUse;
  }
  if (is_list) {
    list();
    return 0;
  }
  if (const std::string unknown = first_unknown(arguments.only); !unknown.empty()) {
    std::cerr << "arbiter-bench: there is no measure \"" << unknown << "\"; these are:\n";
    for (const MeasureEntry& entry : all_measures()) std::cerr << "  " << entry.name << "\n";
    return kWrongUse;
  }
  return run_and_clear_up([&] {
    remember_interruptions();
    return run_or_explain(arguments);
  });
}
