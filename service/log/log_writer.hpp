// Writes lines to a descriptor, from a thread of its own; to a regular file at once, for nobody has
// to read that.
//
// Standard error may be a pipe that nobody reads, a terminal that somebody has stopped, or a
// journal that hangs: write() then blocks for as long as they like. The daemon's loop must not, so
// it puts lines into a bounded queue, and this thread alone waits for the reader. What does not fit
// is lost, and counted; the count is written where the lines would have stood.
//
// Where there is a journal, lines are sent there as records, from the same thread; a line that the
// journal does not take goes to the descriptor.
//
// Thread safety: put() may be called by any thread. One mutex guards the queue; the thread does not
// hold it while it writes.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "service/log/journal.hpp"

namespace arbiter::service {

class LogWriter {
 public:
  // How many bytes may wait for the reader.
  static constexpr std::size_t kMaxWaiting = 1 << 20;

  // Writes to a copy of `fd`. Throws std::system_error where no descriptor or thread can be had.
  explicit LogWriter(int fd, std::optional<JournalSocket> journal = {});
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;
  // As finish(), within a second.
  ~LogWriter();

  [[nodiscard]] bool has_journal() const noexcept { return has_journal_; }
  // Never waits for the reader. `line` has its line end; `record` is the same for the journal.
  void put(std::string line, std::string record = {});
  // Waits until all is written, at most `limit`; then leaves the thread, which may be blocked for
  // ever, to the end of the process. False: not all was written. Lines put later are lost.
  bool finish(std::chrono::milliseconds limit);

 private:
  struct Shared;

  const bool has_journal_;
  const bool needs_reader_;
  std::shared_ptr<Shared> shared_;  // the thread's too: it may outlive this
  std::thread thread_;
};

}  // namespace arbiter::service
