#include "gateway/core/say.hpp"

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <string>
#include <utility>

#include "logging/journal.hpp"
#include "logging/log_writer.hpp"
#include "shm/utf8.hpp"

namespace arbiter::gateway {
namespace {

// For a reader that reads. Within it the writer's thread has long had its turn.
constexpr std::chrono::milliseconds kPatience{10};
constexpr std::chrono::milliseconds kPatienceAtEnd{1000};

std::string& program_name() {
  static std::string name = "arbiter-gateway";
  return name;
}

// systemd reads the level there.
std::string begin_of(Level level) {
  static const bool is_journal = logging::is_journal(STDERR_FILENO, std::getenv("JOURNAL_STREAM"));
  if (!is_journal) return program_name() + ": ";
  const char priority = level == Level::kError     ? logging::kErrorPriority
                        : level == Level::kWarning ? logging::kWarningPriority
                                                   : logging::kInfoPriority;
  return std::string("<") + priority + ">";
}

class StandardError {
 public:
  StandardError() : writer_(logging::LogWriter::to_standard_error(begin_of(Level::kWarning))) {}

  // Whoever dies next has its last words in the log, unless the machine is loaded. Where nobody
  // reads it, only the first line waits, until the reader has caught up.
  void write(std::string line) {
    writer_.put(std::move(line));
    const bool is_unread = is_unread_.load(std::memory_order_relaxed);
    const bool is_read = writer_.wait(is_unread ? std::chrono::milliseconds(0) : kPatience);
    is_unread_.store(!is_read, std::memory_order_relaxed);
  }
  void end() { writer_.wait(kPatienceAtEnd); }

 private:
  logging::LogWriter writer_;
  // Whoever says something writes it. Relaxed is enough: it is a hint how long to wait, and the
  // lines themselves are under the writer's mutex.
  std::atomic<bool> is_unread_{false};
};

// Never destroyed: threads may say something until the process ends.
StandardError& standard_error() {
  static StandardError& made = *new StandardError;
  static const int at_exit = std::atexit([] { standard_error().end(); });
  static_cast<void>(at_exit);
  return made;
}

}  // namespace

void set_program_name(std::string_view name) { program_name() = name; }

void say_lines(std::string lines) {
  if (!lines.empty()) standard_error().write(std::move(lines));
}

void finish_saying() { standard_error().end(); }

void say(Level level, std::string_view text) {
  standard_error().write(begin_of(level) + shm::printable(text) + "\n");
}

}  // namespace arbiter::gateway
