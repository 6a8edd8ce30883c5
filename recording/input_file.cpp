#include "recording/input_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "recording/bytes.hpp"
#include "recording/mcap.hpp"

namespace arbiter::recording {
namespace {

// Many records are short: one system call reads many of them.
constexpr std::size_t kWindow = 65'536;

}  // namespace

InputFile::InputFile(const std::string& path)
    // Of a pipe without a writer, opening would not return.
    : fd_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  if (fd_ < 0) throw McapError("cannot open " + path + ": " + std::strerror(errno));
  struct stat found {};
  if (::fstat(fd_, &found) != 0 || !S_ISREG(found.st_mode)) {
    ::close(fd_);
    throw McapError("cannot read " + path + ": it is not a regular file");
  }
  size_ = static_cast<std::uint64_t>(found.st_size);
}

InputFile::~InputFile() { ::close(fd_); }

std::string_view InputFile::read(std::uint64_t offset, std::size_t count) {
  if (offset >= window_at_ && count <= window_.size() &&
      offset - window_at_ <= window_.size() - count) {
    return std::string_view(window_).substr(offset - window_at_, count);
  }
  const std::size_t wanted =
      std::max(count, static_cast<std::size_t>(std::min<std::uint64_t>(kWindow, size_ - offset)));
  window_.resize(wanted);
  window_at_ = offset;
  std::size_t have = 0;
  while (have < wanted) {
    const ssize_t got =
        ::pread(fd_, window_.data() + have, wanted - have, static_cast<off_t>(offset + have));
    if (got < 0 && errno == EINTR) continue;
    const int error = errno;
    if (got <= 0) window_.resize(have);
    if (got < 0) throw Damage{std::string("it cannot be read: ") + std::strerror(error)};
    if (got == 0) throw Damage{"the file has become shorter while it was read"};
    have += static_cast<std::size_t>(got);
  }
  return std::string_view(window_).substr(0, count);
}

}  // namespace arbiter::recording
