// Results that go to a file, or to standard output.
#pragma once

#include <string>

namespace arbiter::cli {

// Whoever reads the file sees the old content or the new one, never a part. What is no regular file
// is written as it is. Throws rules::FileError.
void write_output(const std::string& path, const std::string& content);

// To the file if there is one, else to standard output.
inline constexpr const char* kOutputHelp = "File to write; without it, standard output";

}  // namespace arbiter::cli
