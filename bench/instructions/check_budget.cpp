// Runs the operations under callgrind beside a daemon, and holds what they cost against the budget.
//
//   instruction_budget            compare with budget.txt; exit code 1 where a call costs more
//   instruction_budget --update   write budget.txt
#include <chrono>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/harness/program.hpp"
#include "bench/instructions/budget.hpp"
#include "bench/instructions/scenes.hpp"
#include "cli/progress.hpp"

namespace arbiter::bench {
namespace {

// callgrind's output has a part for each measure:
//   desc: Trigger: Client Request: MEASURE * TIMES
//   …
//   totals: INSTRUCTIONS
Counts read_counts(const std::string& path) {
  constexpr char kTrigger[] = "desc: Trigger: Client Request: ";
  constexpr char kTotals[] = "totals: ";
  Counts counts;
  std::ifstream file(path);
  std::string measure;
  long times = 0;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind(kTrigger, 0) == 0) {
      const auto star = line.rfind(" * ");
      measure = line.substr(sizeof kTrigger - 1, star - (sizeof kTrigger - 1));
      times = std::stol(line.substr(star + 3));
    } else if (line.rfind(kTotals, 0) == 0 && times != 0) {
      const long total = std::stol(line.substr(sizeof kTotals - 1));
      counts.push_back({measure, (total + times / 2) / times});
      times = 0;
    }
  }
  return counts;
}

// Says how far it is, which takes a minute, until it has ended.
void watch(Program& operations, const std::string& output) {
  std::size_t all = 0;
  try {
    all = read_budget(BUDGET).counts.size();
  } catch (const std::runtime_error&) {
    // It is about to be written.
  }
  cli::ProgressLine progress;
  while (!operations.ends_within(std::chrono::milliseconds(100))) {
    progress.show([&] {
      const Counts counts = read_counts(output);
      return "counting under callgrind: " + std::to_string(counts.size()) +
             (all == 0 ? "" : " of " + std::to_string(all)) + " measures" +
             (counts.empty() ? "" : ", the last: " + counts.back().measure);
    });
  }
}

std::string write(const std::string& path, const std::string& text) {
  std::ofstream(path) << text;
  return path;
}

std::string read(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

Budget measure() {
  const ScratchDirectory directory;
  const std::string log = directory.path() + "/log";
  const Model model;
  const std::string model_file = write(directory.path() + "/model.xml", model.model());
  const std::string application = write(directory.path() + "/application.xml", model.application());
  const std::string output = directory.path() + "/callgrind.out";
  // The C library picks its memcpy() by the processor; this is the one that all have.
  const Program::Variables environment{{"XDG_RUNTIME_DIR", directory.path()},
                                       {"RUNTIME_DIRECTORY", std::nullopt},
                                       {"ARBITER_INSTANCE", "instructions"},
                                       {"GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX2,-AVX,-ERMS"}};
  const Program daemon(
      {ARBITERD, "--model", model_file, "--application", application, "--log-level", "warn"},
      environment, log);
  Program operations({"/usr/bin/valgrind", "--tool=callgrind", "--quiet", "--collect-atstart=no",
                      "--combine-dumps=yes", "--callgrind-out-file=" + output, OPERATIONS},
                     environment, log);
  watch(operations, output);
  if (operations.exit_code() != 0) {
    throw std::runtime_error("the operations failed under valgrind: " + read(log));
  }
  Budget measured{BUILT_WITH, read_counts(output)};
  if (measured.counts.empty()) throw std::runtime_error("callgrind has counted nothing");
  return measured;
}

}  // namespace
}  // namespace arbiter::bench

int main(int argc, char** argv) {
  using namespace arbiter::bench;
  const bool updates = argc == 2 && std::strcmp(argv[1], "--update") == 0;
  if (argc > 2 || (argc == 2 && !updates)) {
    std::fprintf(stderr, "usage: instruction_budget [--update]\n");
    return 2;
  }
  try {
    const Budget measured = measure();
    if (!updates) return compare(measured, read_budget(BUDGET), std::cout) ? 0 : 1;
    write_budget(BUDGET, measured);
    compare(measured, read_budget(BUDGET), std::cout);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "instruction_budget: %s\n", error.what());
    return 1;
  }
}
