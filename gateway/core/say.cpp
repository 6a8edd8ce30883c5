#include "gateway/core/say.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "shm/utf8.hpp"

namespace arbiter::gateway {
namespace {

std::string& program_name() {
  static std::string name = "arbiter-gateway";
  return name;
}

// systemd names the device and inode of the stream that it has made for us.
bool leads_to_journal() {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat is {};
  if (stream == nullptr || ::fstat(STDERR_FILENO, &is) != 0) return false;
  return std::to_string(is.st_dev) + ":" + std::to_string(is.st_ino) == stream;
}

const char* priority_of(Level level) {
  if (level == Level::kError) return "<3>";
  return level == Level::kWarning ? "<4>" : "<6>";
}

}  // namespace

void set_program_name(std::string_view name) { program_name() = name; }

// In one write, so that lines of several threads and processes stay whole.
void say(Level level, std::string_view text) {
  static const bool is_journal = leads_to_journal();
  const std::string begin = is_journal ? priority_of(level) : program_name() + ": ";
  const std::string line = begin + shm::printable(text) + "\n";
  static_cast<void>(!::write(STDERR_FILENO, line.data(), line.size()));
}

}  // namespace arbiter::gateway
