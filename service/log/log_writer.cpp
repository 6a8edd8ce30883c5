#include "service/log/log_writer.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <system_error>
#include <utility>
#include <vector>

#include "shm/file_descriptor.hpp"

namespace arbiter::service {

namespace {

bool is_regular_file(int fd) {
  struct stat status {};
  return fstat(fd, &status) == 0 && S_ISREG(status.st_mode);
}

// What cannot be written at all (the reader has closed its end) is given up.
void write_all(int fd, const std::string& text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t written = ::write(fd, text.data() + done, text.size() - done);
    if (written > 0) {
      done += static_cast<std::size_t>(written);
    } else if (errno == EAGAIN) {  // somebody has made it non-blocking for all
      pollfd writable{fd, POLLOUT, 0};
      ::poll(&writable, 1, -1);
    } else if (errno != EINTR) {
      return;
    }
  }
}

}  // namespace

struct LogWriter::Shared {
  struct Line {
    std::string text;
    std::string record;  // for the journal

    [[nodiscard]] std::size_t bytes() const { return sizeof(Line) + text.size() + record.size(); }
  };

  shm::FileDescriptor fd;
  std::optional<JournalSocket> journal;
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<Line> waiting;
  std::size_t bytes_waiting = 0;
  std::uint64_t lost = 0;  // lines that did not fit, since the last that did
  bool is_ending = false;
  bool has_ended = false;  // all is written

  void add(Line line) {
    bytes_waiting += line.bytes();
    waiting.push_back(std::move(line));
  }
  void add_loss();
  void write(const std::vector<Line>& lines) const;
};

// The text in as few calls as there can be.
void LogWriter::Shared::write(const std::vector<Line>& lines) const {
  std::string text;
  for (const Line& line : lines) {
    if (!journal || !journal->send(line.record)) text += line.text;
  }
  write_all(fd.get(), text);
}

void LogWriter::Shared::add_loss() {
  const std::uint64_t lines = std::exchange(lost, 0);
  if (lines == 0) return;
  const std::string text = std::to_string(lines) + " lines were lost here: nobody read the log";
  add({"[log] " + text + "\n", journal_record(text, log::level::warn, nullptr, {})});
}

LogWriter::LogWriter(int fd, std::optional<JournalSocket> journal)
    : has_journal_(journal.has_value()),
      needs_reader_(has_journal_ || !is_regular_file(fd)),
      shared_(std::make_shared<Shared>()) {
  shared_->journal = std::move(journal);
  shared_->fd.reset(fcntl(fd, F_DUPFD_CLOEXEC, 0));
  if (!shared_->fd)
    throw std::system_error(errno, std::generic_category(), "no log can be written");
  if (!needs_reader_) return;
  thread_ = std::thread([shared = shared_] {
    // Where the reader has gone, write() is to fail, not to end the process.
    sigset_t pipe;
    sigemptyset(&pipe);
    sigaddset(&pipe, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &pipe, nullptr);
    std::unique_lock lock(shared->mutex);
    for (;;) {
      shared->changed.wait(lock, [&] { return !shared->waiting.empty() || shared->is_ending; });
      if (shared->waiting.empty()) break;
      const std::vector<Shared::Line> lines = std::exchange(shared->waiting, {});
      shared->bytes_waiting = 0;
      lock.unlock();
      shared->write(lines);
      lock.lock();
    }
    shared->has_ended = true;
    shared->changed.notify_all();
  });
}

LogWriter::~LogWriter() { finish(std::chrono::seconds(1)); }

void LogWriter::put(std::string line, std::string record) {
  const std::lock_guard lock(shared_->mutex);
  if (shared_->is_ending) return;
  if (!needs_reader_) {
    write_all(shared_->fd.get(), line);
    return;
  }
  Shared::Line added{std::move(line), std::move(record)};
  if (shared_->bytes_waiting + added.bytes() > kMaxWaiting) {
    ++shared_->lost;
    return;
  }
  shared_->add_loss();
  shared_->add(std::move(added));
  shared_->changed.notify_all();
}

bool LogWriter::finish(std::chrono::milliseconds limit) {
  if (!thread_.joinable()) return !needs_reader_;
  std::unique_lock lock(shared_->mutex);
  shared_->add_loss();
  shared_->is_ending = true;
  shared_->changed.notify_all();
  const bool is_done = shared_->changed.wait_for(lock, limit, [&] { return shared_->has_ended; });
  lock.unlock();
  is_done ? thread_.join() : thread_.detach();
  return is_done;
}

}  // namespace arbiter::service
