#include "logging/log_writer.hpp"

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

namespace arbiter::logging {

namespace {

bool is_regular_file(int fd) {
  struct stat status {};
  return fstat(fd, &status) == 0 && S_ISREG(status.st_mode);
}

// What cannot be written at all (the reader has closed its end, or nothing is taken) is given up.
// How many bytes were written.
std::size_t write_all(int fd, const std::string& text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t written = ::write(fd, text.data() + done, text.size() - done);
    if (written > 0) {
      done += static_cast<std::size_t>(written);
      continue;
    }
    // That nothing was written is no error, and sets no errno.
    if (written == 0 || (errno != EINTR && errno != EAGAIN)) break;
    if (errno == EINTR) continue;
    pollfd writable{fd, POLLOUT, 0};  // somebody has made it non-blocking for all
    ::poll(&writable, 1, -1);
  }
  return done;
}

std::string say_lost(std::uint64_t lines, const char* why) {
  return std::to_string(lines) + " lines were lost here: " + why;
}

}  // namespace

struct LogWriter::Shared {
  struct Line {
    std::string text;
    std::string record;  // for the journal

    [[nodiscard]] std::size_t bytes() const { return sizeof(Line) + text.size() + record.size(); }
  };

  int fd = -1;
  shm::FileDescriptor own;  // empty: fd is somebody else's
  std::optional<JournalSocket> journal;
  std::string begin = "[log] ";  // of the line that counts what was lost
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<Line> waiting;
  std::size_t bytes_waiting = 0;
  std::uint64_t lost = 0;  // lines that did not fit, since the last that did
  bool is_writing = false;
  bool is_ending = false;
  bool has_ended = false;       // all is written
  std::uint64_t unwritten = 0;  // lines that a file did not take, since the last that it did
  bool is_torn = false;         // the last of these it took in part

  void add(Line line) {
    bytes_waiting += line.bytes();
    waiting.push_back(std::move(line));
  }
  void add_loss();
  [[nodiscard]] bool is_done() const { return waiting.empty() && lost == 0 && !is_writing; }
  void write(const std::vector<Line>& lines) const;
  void write_to_file(const std::string& line);
  bool append(const std::string& line);
  void run();
};

// The text in as few calls as there can be.
void LogWriter::Shared::write(const std::vector<Line>& lines) const {
  std::string text;
  for (const Line& line : lines) {
    if (!journal || !journal->send(line.record)) text += line.text;
  }
  write_all(fd, text);
}

// The disk may be full for a while.
void LogWriter::Shared::write_to_file(const std::string& line) {
  if (unwritten != 0) {
    if (!append((is_torn ? "\n" : "") + begin + say_lost(unwritten, "the file took none") + "\n")) {
      ++unwritten;
      return;
    }
    unwritten = 0;
  }
  if (!append(line)) ++unwritten;
}

// Whether the file took all of it.
bool LogWriter::Shared::append(const std::string& line) {
  const std::size_t done = write_all(fd, line);
  if (done != 0) is_torn = line[done - 1] != '\n';
  return done == line.size();
}

void LogWriter::Shared::add_loss() {
  const std::uint64_t lines = std::exchange(lost, 0);
  if (lines == 0) return;
  const std::string text = say_lost(lines, "nobody read the log");
  add({begin + text + "\n", journal ? journal_record(text, kWarningPriority) : std::string()});
}

void LogWriter::Shared::run() {
  std::unique_lock lock(mutex);
  for (;;) {
    changed.wait(lock, [&] { return !waiting.empty() || lost != 0 || is_ending; });
    add_loss();
    if (waiting.empty()) break;
    const std::vector<Line> lines = std::exchange(waiting, {});
    bytes_waiting = 0;
    is_writing = true;
    lock.unlock();
    write(lines);
    lock.lock();
    is_writing = false;
    changed.notify_all();
  }
  has_ended = true;
  changed.notify_all();
}

LogWriter::LogWriter(std::shared_ptr<Shared> shared, bool needs_reader)
    : has_journal_(shared->journal.has_value()),
      needs_reader_(needs_reader),
      shared_(std::move(shared)) {}

LogWriter::LogWriter(int fd, std::optional<JournalSocket> journal)
    : has_journal_(journal.has_value()),
      needs_reader_(has_journal_ || !is_regular_file(fd)),
      shared_(std::make_shared<Shared>()) {
  shared_->journal = std::move(journal);
  shared_->own = shm::duplicate(fd);
  if (!shared_->own)
    throw std::system_error(errno, std::generic_category(), "no log can be written");
  shared_->fd = shared_->own.get();
}

LogWriter LogWriter::to_standard_error(std::string begin) {
  auto shared = std::make_shared<Shared>();
  shared->fd = STDERR_FILENO;
  shared->begin = std::move(begin);
  return {std::move(shared), !is_regular_file(STDERR_FILENO)};
}

LogWriter::~LogWriter() { finish(std::chrono::seconds(1)); }

// Under the mutex. The thread inherits what is blocked: all, so that signals reach those who wait
// for them, and write() fails, and does not end the process, where the reader has gone.
void LogWriter::start() {
  if (thread_.joinable()) return;
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  try {
    thread_ = std::thread([shared = shared_] { shared->run(); });
  } catch (const std::system_error&) {  // too many threads: the next line tries again
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void LogWriter::put(std::string line, std::string record) {
  const std::lock_guard lock(shared_->mutex);
  if (shared_->is_ending) return;
  if (!needs_reader_) {
    shared_->write_to_file(line);
    return;
  }
  start();
  Shared::Line added{std::move(line), std::move(record)};
  if (shared_->bytes_waiting + added.bytes() > kMaxWaiting) {
    ++shared_->lost;
  } else {
    shared_->add_loss();
    shared_->add(std::move(added));
  }
  shared_->changed.notify_all();
}

bool LogWriter::wait(std::chrono::milliseconds limit) {
  std::unique_lock lock(shared_->mutex);
  return shared_->changed.wait_for(lock, limit, [&] { return shared_->is_done(); });
}

bool LogWriter::finish(std::chrono::milliseconds limit) {
  std::unique_lock lock(shared_->mutex);
  // Then it writes still: no other thread may take what it has to say.
  if (is_left_) return shared_->is_done();
  if (!shared_->is_done()) start();
  shared_->is_ending = true;
  shared_->changed.notify_all();
  if (!thread_.joinable()) return shared_->is_done();
  const bool is_done = shared_->changed.wait_for(lock, limit, [&] { return shared_->has_ended; });
  lock.unlock();
  is_left_ = !is_done;
  is_done ? thread_.join() : thread_.detach();
  return is_done;
}

}  // namespace arbiter::logging
