#include "recording/output_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "recording/crc32.hpp"
#include "recording/directory.hpp"
#include "recording/mcap.hpp"

namespace arbiter::recording {
namespace {

[[noreturn]] void throw_error(int error, const std::string& text) {
  if (error == ENOSPC || error == EDQUOT) throw NoRoomError(text);
  throw McapError(text);
}

const char* advice_for(int error) {
  switch (error) {
    case ENOSPC:
    case EDQUOT:
      return "; make room, or choose another file system";
    case EFBIG:
      return "; raise the limit to the size of files (ulimit -f), or choose another file system";
    case EEXIST:
      return "; choose another name, or delete it";
    default:
      return "";
  }
}

}  // namespace

OutputFile::OutputFile(const std::string& path, Unfinished unfinished)
    : path_(path), unfinished_(unfinished) {
  // Samples are for whom the policy lets watch them: here, for who records.
  fd_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (fd_ < 0) {
    const int error = errno;
    throw_error(error, "cannot create " + path + ": " + std::strerror(error) + advice_for(error));
  }
}

OutputFile::~OutputFile() {
  if (fd_ < 0) return;
  if (unfinished_ == Unfinished::discard) unlink_mine();
  ::close(fd_);
}

// Somebody may have put another file there.
bool OutputFile::unlink_mine() noexcept {
  struct stat mine {};
  struct stat there {};
  return ::fstat(fd_, &mine) == 0 && ::lstat(path_.c_str(), &there) == 0 &&
         mine.st_dev == there.st_dev && mine.st_ino == there.st_ino && ::unlink(path_.c_str()) == 0;
}

void OutputFile::refuse(const std::string& what, const std::string& reason) const {
  throw McapError(text_of(what, reason));
}

std::string OutputFile::text_of(const std::string& what, const std::string& reason) const {
  return "cannot " + what + " to " + path_ + ": " + reason;
}

void OutputFile::require_open(const std::string& what) const {
  if (!ended_.empty()) refuse(what, ended_);
  if (fd_ < 0) refuse(what, "it is closed");
}

void OutputFile::fail(const char* what, int error) {
  ended_ = std::strerror(error);
  // An empty file would be in the way of the next attempt.
  if (unfinished_ == Unfinished::keep && bytes_ != 0) {
    // What could be written of a record would end the reading all the same, with a worse message.
    [[maybe_unused]] const int truncated = ::ftruncate(fd_, static_cast<off_t>(bytes_));
    ended_ += ". It ends after the last whole record, at byte " + std::to_string(bytes_);
  } else {
    if (unlink_mine()) ended_ += "; it was deleted";
    ::close(std::exchange(fd_, -1));
  }
  ended_ += advice_for(error);
  throw_error(error, text_of(what, ended_));
}

void OutputFile::write(std::string_view bytes) {
  require_open("write");
  require_untouched();
  std::string_view left = bytes;
  while (!left.empty()) {
    const ssize_t count = ::write(fd_, left.data(), left.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) fail("write", count < 0 ? errno : ENOSPC);
    left.remove_prefix(static_cast<std::size_t>(count));
  }
  crc_ = crc32(bytes, crc_);
  bytes_ += bytes.size();
}

// The kernel writes on into a file that has no name any more, and fills one that was cut with
// zeros, after which it has the size that it should have.
void OutputFile::require_untouched() {
  struct stat found {};
  if (::fstat(fd_, &found) != 0) fail("write", errno);
  const auto size = static_cast<std::uint64_t>(found.st_size);
  if (found.st_nlink != 0 && size == bytes_) return;
  ended_ = found.st_nlink == 0
               ? "somebody has deleted it meanwhile"
               : "somebody else has written to it, or cut it: it has " + std::to_string(size) +
                     " bytes, and " + std::to_string(bytes_) + " were written";
  refuse("write", ended_);
}

void OutputFile::sync() {
  require_open("write");
  require_untouched();
  if (::fdatasync(fd_) != 0) fail("write", errno);
  if (std::exchange(is_synced_before_, true)) return;
  // A new file is lost with its directory's entry.
  if (const int error = sync_directory_of(path_); error != 0) fail("write", error);
}

void OutputFile::close() {
  require_open("write");
  require_untouched();
  // Where the file is another machine's, this is when a quota may be exceeded: a second descriptor
  // is told of it while there is one to end the file by.
  const int second = ::fcntl(fd_, F_DUPFD_CLOEXEC, 0);
  if (second >= 0 && ::close(second) != 0 && errno != EINTR) fail("write", errno);
  ::close(std::exchange(fd_, -1));
}

}  // namespace arbiter::recording
