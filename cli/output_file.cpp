#include "cli/output_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <system_error>

#include "cli/broken_pipe.hpp"
#include "rules/model/load.hpp"

namespace arbiter::cli {
namespace {

[[noreturn]] void fail(const std::string& path) {
  if (errno == EPIPE) end_by_broken_pipe();  // /dev/stdout, or a pipe with a name
  throw rules::FileError("cannot write " + path + ": " + std::strerror(errno));
}

void write_to(const std::string& path, const std::string& content) {
  errno = 0;
  std::ofstream file(path, std::ios::binary);
  file.write(content.data(), static_cast<std::streamsize>(content.size()));
  file.close();  // which may be the first to hear that there is no room: of a file server, a quota
  if (!file) fail(path);
}

// By its own name, too: where a shell has led it to a file, that would look like one that is there.
bool is_standard_output(const std::string& path) {
  return path.empty() || path == "-" || path == "/dev/stdout";
}

// A terminal may well be read and written.
bool is_one_regular_file(const std::string& path, const std::string& other) {
  struct stat one {};
  struct stat two {};
  return stat(path.c_str(), &one) == 0 && S_ISREG(one.st_mode) && stat(other.c_str(), &two) == 0 &&
         one.st_dev == two.st_dev && one.st_ino == two.st_ino;
}

// Where neither is there yet.
bool will_be_one_file(const std::string& path, const std::string& other) {
  namespace fs = std::filesystem;
  std::error_code unknown;
  if (fs::exists(path, unknown) || fs::exists(other, unknown)) return false;
  // Of a relative name of which nothing is there, weakly_canonical() makes no absolute one.
  const auto place_of = [&](const std::string& each) {
    return fs::weakly_canonical(fs::absolute(each, unknown), unknown);
  };
  const fs::path place = place_of(path);
  return !place.empty() && place == place_of(other);
}

// Where links lead to, also if it is not there yet.
std::filesystem::path target_of(std::filesystem::path path) {
  constexpr int kMostLinks = 40;  // as the kernel has it
  std::error_code no_link;
  for (int i = 0; i < kMostLinks; ++i) {
    const auto next = std::filesystem::read_symlink(path, no_link);
    if (no_link) break;
    path = path.parent_path() / next;
  }
  return path;
}

// Beside it, and as short, where its own name has no room for more.
std::string temporary_beside(const std::filesystem::path& target) {
  constexpr std::size_t kMostOfName = 200;
  const std::string name = target.filename().string().substr(0, kMostOfName);
  return (target.parent_path() / (name + ".new-" + std::to_string(getpid()))).string();
}

}  // namespace

void require_no_input(const std::string& option, const std::string& output,
                      const std::string& input) {
  if (is_standard_output(output) || !is_one_regular_file(output, input)) return;
  throw rules::FileError(option + ' ' + output + " would overwrite " +
                         (input == output ? "the input" : input + ", an input") +
                         "; nothing was written: give another file");
}

void require_no_input(const std::string& output, const rules::ModelTexts& inputs) {
  for (const rules::FileText& input : inputs.models) {
    require_no_input("--output", output, input.path);
  }
  if (inputs.application) require_no_input("--output", output, inputs.application->path);
}

void require_two_files(const std::string& option, const std::string& output,
                       const std::string& other_option, const std::string& other) {
  const bool is_any_standard_output = is_standard_output(output) || is_standard_output(other);
  const bool is_one = is_any_standard_output
                          ? is_standard_output(output) && is_standard_output(other)
                          : is_one_regular_file(output, other) || will_be_one_file(output, other);
  if (!is_one) return;
  throw rules::FileError(option + ' ' + output + " and " + other_option + ' ' + other +
                         " are one file; nothing was written: give another file");
}

void require_named_file(const std::string& output, const std::string& why) {
  if (!output.empty() && is_standard_output(output)) throw CLI::ValidationError("--output", why);
}

void add_force_option(CLI::App& verb, bool& replaces) {
  verb.add_flag("--force", replaces, "Replace files that are there already");
}

// However large it is, no more of it is read than is compared.
bool holds_already(const std::string& path, const std::string& content) {
  std::error_code unknown;
  if (is_standard_output(path) || !std::filesystem::is_regular_file(path, unknown) ||
      std::filesystem::file_size(path, unknown) != content.size()) {
    return false;
  }
  std::ifstream file(path, std::ios::binary);
  std::string there(content.size(), '\0');
  return file.read(there.data(), static_cast<std::streamsize>(there.size())) && there == content;
}

void require_new_file(const std::string& output, bool replaces) {
  std::error_code unknown;
  if (replaces || is_standard_output(output) ||
      !std::filesystem::is_regular_file(output, unknown)) {
    return;
  }
  throw rules::FileError(output +
                         " is there already; nothing was written: give another file, or --force to "
                         "replace it");
}

void write_output(const std::string& path, const std::string& content) {
  namespace fs = std::filesystem;
  if (is_standard_output(path)) {
    std::cout << content;
    return;
  }
  std::error_code unknown;
  const fs::file_status status = fs::status(path, unknown);
  if (fs::exists(status) && !fs::is_regular_file(status)) return write_to(path, content);
  const fs::path target = target_of(path);  // a link stays one: what it leads to is replaced
  const std::string temporary = temporary_beside(target);
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
