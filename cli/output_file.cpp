#include "cli/output_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "rules/load.hpp"

namespace arbiter::cli {
namespace {

[[noreturn]] void fail(const std::string& path) {
  throw rules::FileError("cannot write " + path + ": " + std::strerror(errno));
}

void write_to(const std::string& path, const std::string& content) {
  errno = 0;
  std::ofstream file(path, std::ios::binary);
  if (!file.write(content.data(), static_cast<std::streamsize>(content.size())) || !file.flush()) {
    fail(path);
  }
}

}  // namespace

void write_output(const std::string& path, const std::string& content) {
  namespace fs = std::filesystem;
  if (path.empty()) {
    std::cout << content;
    return;
  }
  std::error_code unknown;
  const fs::file_status status = fs::status(path, unknown);
  if (fs::exists(status) && !fs::is_regular_file(status)) return write_to(path, content);
  // A link stays one: what it leads to is replaced.
  const fs::path target = fs::exists(status) ? fs::canonical(path, unknown) : fs::path(path);
  const std::string temporary = target.string() + ".new-" + std::to_string(getpid());
  try {
    write_to(temporary, content);
  } catch (const rules::FileError&) {
    const int why = errno;
    fs::remove(temporary, unknown);
    errno = why;
    fail(path);
  }
  if (fs::exists(status)) fs::permissions(temporary, status.permissions(), unknown);
  if (std::rename(temporary.c_str(), target.c_str()) != 0) {
    const int why = errno;
    fs::remove(temporary, unknown);
    errno = why;
    fail(path);
  }
}

}  // namespace arbiter::cli
