// Results that go to two files.
#pragma once

#include <filesystem>
#include <string>
#include <system_error>

#include "cli/output_file.hpp"

namespace arbiter::cli {

// Writes a file, then does the rest. If that throws, a file that was not there before is deleted:
// it would be in the way when the user tries again.
template <class Rest>
void write_first(const std::string& path, const std::string& content, const Rest& rest) {
  std::error_code unknown;
  const bool was_there = std::filesystem::exists(path, unknown);
  write_output(path, content);
  try {
    rest();
  } catch (...) {
    if (!was_there) std::filesystem::remove(path, unknown);
    throw;
  }
}

}  // namespace arbiter::cli
