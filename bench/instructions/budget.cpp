#include "bench/instructions/budget.hpp"

#include <algorithm>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <stdexcept>

namespace arbiter::bench {
namespace {

constexpr char kBuiltWith[] = "# built with: ";

const Count* find(const Counts& counts, const std::string& measure) {
  const auto found = std::find_if(counts.begin(), counts.end(),
                                  [&](const Count& count) { return count.measure == measure; });
  return found == counts.end() ? nullptr : &*found;
}

long tolerance(long budget) { return budget / 50 + 2; }

}  // namespace

bool is_within(long instructions, long budget) {
  return instructions <= budget + tolerance(budget);
}

Budget read_budget(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path + "; --update writes it");
  Budget budget;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (line.rfind(kBuiltWith, 0) == 0) budget.built_with = line.substr(sizeof kBuiltWith - 1);
    if (line.empty() || line[0] == '#') continue;
    try {
      std::size_t end = 0;
      const long instructions = std::stol(line, &end);
      budget.counts.push_back({line.substr(line.find_first_not_of(' ', end)), instructions});
    } catch (const std::logic_error&) {
      throw std::runtime_error(path + ":" + std::to_string(number) +
                               ": not a number and a measure");
    }
  }
  return budget;
}

void write_budget(const std::string& path, const Budget& budget) {
  std::ofstream file(path);
  file << "# Instructions for each call of the data path, under callgrind: what it may cost.\n"
          "# Written by: ./run instructions --update. Counts depend on compiler and flags, so "
          "these\n"
          "# hold for Debian 12's, as CI uses them.\n"
       << kBuiltWith << budget.built_with << '\n';
  for (const Count& count : budget.counts) {
    file << std::setw(6) << count.instructions << "  " << count.measure << '\n';
  }
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path);
}

bool compare(const Budget& measured, const Budget& budget, std::ostream& out) {
  bool is_kept = true;
  bool is_loose = false;
  out << std::left << std::setw(46) << "measure" << std::right << std::setw(13) << "instructions"
      << std::setw(8) << "budget" << std::setw(12) << "difference" << '\n';
  for (const auto& [measure, instructions] : measured.counts) {
    out << std::left << std::setw(46) << measure << std::right << std::setw(13) << instructions;
    const Count* allowed = find(budget.counts, measure);
    if (allowed == nullptr) {
      out << "  NO BUDGET\n";
      is_kept = false;
      continue;
    }
    const long difference = instructions - allowed->instructions;
    out << std::setw(8) << allowed->instructions << std::setw(12) << std::showpos << difference
        << std::noshowpos;
    if (!is_within(instructions, allowed->instructions)) {
      out << "  OVER";
      is_kept = false;
    } else if (!is_within(allowed->instructions, instructions)) {
      out << "  under";
      is_loose = true;
    }
    out << '\n';
  }
  for (const auto& [measure, instructions] : budget.counts) {
    if (find(measured.counts, measure) != nullptr) continue;
    out << measure << ": has a budget and was not measured\n";
    is_kept = false;
  }
  if (measured.built_with != budget.built_with) {
    out << "The budget is for another compiler or other flags: " << budget.built_with
        << "\nThis is: " << measured.built_with << '\n';
  }
  if (!is_kept) {
    out << "A call costs more than its budget. If it must: ./run instructions --update, and say "
           "why "
           "in the commit.\n";
  } else if (is_loose) {
    out << "The budget is loose. Tighten it: ./run instructions --update\n";
  }
  return is_kept;
}

}  // namespace arbiter::bench
