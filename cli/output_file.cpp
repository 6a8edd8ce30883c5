#include "cli/output_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "rules/model/load.hpp"

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

void require_no_input(const std::string& output, const rules::ModelTexts& inputs) {
  struct stat written {};
  // A terminal may well be read and written.
  if (stat(output.c_str(), &written) != 0 || !S_ISREG(written.st_mode)) return;
  const auto require_other = [&](const std::string& input) {
    struct stat read {};
    if (stat(input.c_str(), &read) != 0) return;
    if (read.st_dev != written.st_dev || read.st_ino != written.st_ino) return;
    throw rules::FileError("--output " + output + " would overwrite " +
                           (input == output ? "the input" : input + ", an input") +
                           "; nothing was written: give another file");
  };
  for (const rules::FileText& input : inputs.models) require_other(input.path);
  if (inputs.application) require_other(inputs.application->path);
}

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
