#include "cli/progress.hpp"

#include <unistd.h>

#include <iostream>
#include <string>
#include <utility>

#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kFirstOnTerminal{300}, kFirstInLog{2000};
constexpr milliseconds kEveryOnTerminal{100}, kEveryInLog{10'000};
constexpr std::size_t kMaxBytesOfName = 48;

// Of a statement, as much as a line has room for.
std::string shortened(const std::string& name) {
  if (name.size() <= kMaxBytesOfName) return name;
  return std::string(shm::beginning_of(name, kMaxBytesOfName)) + "…";
}

}  // namespace

ProgressLine::ProgressLine() : ProgressLine(std::cerr, isatty(STDERR_FILENO) != 0, Clock::now) {}

ProgressLine::ProgressLine(std::ostream& out, bool is_terminal,
                           std::function<Clock::time_point()> now)
    : out_(out),
      is_terminal_(is_terminal),
      now_(std::move(now)),
      start_(now_()),
      next_(start_ + (is_terminal ? kFirstOnTerminal : kFirstInLog)) {}

rules::Budget::Watch ProgressLine::watch() {
  return [this](const rules::Progress& progress) {
    if (progress.of == 0) return;
    show([&] {
      return progress.stage + ": " + std::to_string(progress.done) + " of " +
             std::to_string(progress.of) + " (" + shortened(progress.name) + ')';
    });
  };
}

std::function<void(std::uint64_t, std::uint64_t)> ProgressLine::watch(std::string stage) {
  return [this, stage = std::move(stage)](std::uint64_t done, std::uint64_t all) {
    if (all == 0) return;
    show([&] { return stage + ": " + std::to_string(done * 100 / all) + " %"; });
  };
}

void ProgressLine::show(const std::function<std::string()>& text) {
  const Clock::time_point now = now_();
  if (now < next_) return;
  next_ = now + (is_terminal_ ? kEveryOnTerminal : kEveryInLog);
  out_ << (is_terminal_ ? "\r\033[K" : "") << text() << (is_terminal_ ? "" : "\n") << std::flush;
  is_shown_ = is_terminal_;
}

void ProgressLine::clear() {
  if (std::exchange(is_shown_, false)) out_ << "\r\033[K" << std::flush;
}

}  // namespace arbiter::cli
