// The budget of instructions: read, compared, written.
#pragma once

#include <iosfwd>
#include <string>
#include <utility>
#include <vector>

namespace arbiter::bench {

struct Count {
  std::string measure;
  long instructions = 0;
};
using Counts = std::vector<Count>;  // in the order in which they are measured

struct Budget {
  std::string built_with;
  Counts counts;
};

// Counts may differ by so much and no more: 2 %, and 2 instructions.
bool is_within(long instructions, long budget);

// Throws std::runtime_error naming the line that is wrong.
Budget read_budget(const std::string& path);
void write_budget(const std::string& path, const Budget& budget);

// Prints a table; true: nothing is over its budget, and all that was measured has one.
bool compare(const Budget& measured, const Budget& budget, std::ostream& out);

}  // namespace arbiter::bench
