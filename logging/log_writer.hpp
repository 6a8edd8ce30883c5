// Writes lines to a descriptor, from a thread of its own; to a regular file at once, for nobody has
// to read that. Lines that the file does not take, as on a full disk, are counted too.
//
// Standard error may be a pipe that nobody reads, a terminal that somebody has stopped, or a
// journal that hangs: write() then blocks for as long as they like. No loop and no thread of
// somebody else's must, so they put lines into a bounded queue, and this thread alone waits for the
// reader. What does not fit is lost, and counted; the count is written where the lines would have
// stood.
//
// Where there is a journal, lines are sent there as records, from the same thread; a line that the
// journal does not take goes to the descriptor.
//
// The first line that needs the thread starts it; it takes no signal from anybody. It holds no lock
// while it writes, so that a fork() does not wait for it; the child, which has no such thread, must
// log nothing.
//
// Thread safety: put() and wait() may be called by any thread. One mutex guards the queue.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "logging/journal.hpp"

namespace arbiter::logging {

class LogWriter {
 public:
  // How many bytes may wait for the reader.
  static constexpr std::size_t kMaxWaiting = 1 << 20;

  // Writes to a copy of `fd`. Throws std::system_error where no descriptor can be had.
  explicit LogWriter(int fd, std::optional<JournalSocket> journal = {});
  // Writes to standard error, wherever it leads then, and so takes no descriptor. `begin`: of the
  // line that counts what was lost.
  static LogWriter to_standard_error(std::string begin);
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;
  // As finish(), within a second.
  ~LogWriter();

  [[nodiscard]] bool has_journal() const noexcept { return has_journal_; }
  // Never waits for the reader. `line` has its line end; `record` is the same for the journal.
  // Where no thread can be had, the line waits until the next one starts it.
  void put(std::string line, std::string record = {});
  // Waits until all that was put is written, at most `limit`. False: not all was.
  bool wait(std::chrono::milliseconds limit);
  // The same, and then leaves the thread, which may be blocked for ever, to the end of the process.
  // Lines put later are lost.
  bool finish(std::chrono::milliseconds limit);

 private:
  struct Shared;

  LogWriter(std::shared_ptr<Shared> shared, bool needs_reader);
  void start();

  const bool has_journal_;
  const bool needs_reader_;
  std::shared_ptr<Shared> shared_;  // the thread's too: it may outlive this
  std::thread thread_;
  bool is_left_ = false;  // to write by itself
};

}  // namespace arbiter::logging
