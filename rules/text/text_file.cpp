#include "rules/text/text_file.hpp"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "shm/utf8.hpp"

namespace arbiter::rules {
namespace {

[[noreturn]] void fail(const std::string& path, const char* what, int error) {
  throw FileError("cannot " + std::string(what) + " " + path + ": " + std::strerror(error));
}

const char* kind_of(mode_t mode) {
  if (S_ISFIFO(mode)) return "a FIFO";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

void require_regular(const std::string& path, const struct stat& status) {
  if (S_ISREG(status.st_mode)) return;
  if (S_ISDIR(status.st_mode)) fail(path, "read", EISDIR);
  throw FileError("cannot read " + path + ": it is not a regular file but " +
                  kind_of(status.st_mode));
}

// Of a FIFO: that it has a name, and is no pipe that a shell has laid (`<(…)`, /dev/stdin).
bool has_name(const std::string& path) {
  struct statfs status {};
  return ::statfs(path.c_str(), &status) == 0 && status.f_type != PIPEFS_MAGIC;
}

// To open a FIFO takes until somebody opens the other end: for ever, perhaps.
int open_any(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0 && S_ISFIFO(status.st_mode) && has_name(path)) {
    require_regular(path, status);
  }
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) fail(path, "open", errno);
  return fd;
}

// Looks before it opens, for that alone may set a device off; and again behind it, for it may have
// become another file meanwhile, which O_NONBLOCK keeps from holding us up.
int open_regular(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) fail(path, "open", errno);
  require_regular(path, status);
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (fd < 0) fail(path, "open", errno);
  try {
    if (::fstat(fd, &status) != 0) fail(path, "open", errno);
    require_regular(path, status);
  } catch (...) {
    ::close(fd);
    throw;
  }
  return fd;
}

class Descriptor {
 public:
  Descriptor(const std::string& path, Accept accept)
      : fd_(accept == Accept::kRegularFile ? open_regular(path) : open_any(path)) {}
  ~Descriptor() { ::close(fd_); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

// As nearly all are: those of ASCII that print.
bool is_plain(char byte) { return byte >= ' ' && byte <= '~'; }

std::string in_hex(unsigned value) {
  static constexpr char kDigits[] = "0123456789abcdef";
  return {'0', 'x', kDigits[value >> 4 & 15], kDigits[value & 15]};
}

}  // namespace

TextFile::TextFile(std::string path, std::string content)
    : path_(std::move(path)), content_(std::move(content)) {
  if (content_.starts_with("\xef\xbb\xbf")) content_.erase(0, 3);
  line_starts_.push_back(0);
  for (std::size_t end = content_.find('\n'); end != std::string::npos;
       end = content_.find('\n', end + 1)) {
    line_starts_.push_back(end + 1);
  }
}

Location TextFile::locate(std::size_t offset) const {
  offset = std::min(offset, content_.size());
  const auto next = std::upper_bound(line_starts_.begin(), line_starts_.end(), offset);
  const auto line = static_cast<std::uint32_t>(next - line_starts_.begin());
  return {path_, line, static_cast<std::uint32_t>(offset - *(next - 1) + 1)};
}

std::string read_bytes(const std::string& path, std::size_t limit, Accept accept) {
  const Descriptor file(path, accept);
  std::string content;
  std::array<char, 65536> buffer;
  while (content.size() <= limit) {
    const ssize_t count = ::read(file.get(), buffer.data(), buffer.size());
    if (count == 0) break;
    if (count > 0) {
      content.append(buffer.data(), static_cast<std::size_t>(count));
    } else if (errno != EINTR) {
      fail(path, "read", errno);
    }
  }
  return content;
}

std::vector<std::string> files_in(const std::string& list) {
  struct stat status {};
  if (list.find(',') == std::string::npos || ::stat(list.c_str(), &status) == 0) return {};
  std::vector<std::string> files;
  for (std::size_t begin = 0; begin <= list.size();) {
    const std::size_t comma = std::min(list.find(',', begin), list.size());
    files.push_back(list.substr(begin, comma - begin));
    if (::stat(files.back().c_str(), &status) != 0) return {};
    begin = comma + 1;
  }
  return files;
}

bool check_size(const TextFile& file, std::size_t limit, Diagnostics& diagnostics) {
  if (file.content().size() <= limit) return true;
  diagnostics.error("limit-exceeded", file.locate(0),
                    "the file is larger than the limit of " + std::to_string(limit >> 20) +
                        " MiB; split it into several files");
  return false;
}

bool check_characters(const TextFile& file, Diagnostics& diagnostics, std::size_t begin,
                      std::size_t end) {
  if (!check_size(file, kMaxFileBytes, diagnostics)) return false;
  const std::string_view content = file.content().substr(0, end);
  for (std::size_t i = begin; i < content.size();) {
    if (is_plain(content[i])) {
      ++i;
      continue;
    }
    const shm::Utf8Character character = shm::decode_utf8(content.substr(i));
    if (character.length == 0) {
      diagnostics.error("invalid-character", file.locate(i),
                        "the byte " + in_hex(static_cast<unsigned char>(content[i])) +
                            " is not UTF-8 here; save the file in UTF-8");
      return false;
    }
    if (shm::is_control(character.code) && !shm::is_blank(content[i])) {
      diagnostics.error("invalid-character", file.locate(i),
                        "the control character " + in_hex(character.code) +
                            " must not occur in this file; " +
                            (character.code == 0 ? "save the file in UTF-8" : "remove it"));
      return false;
    }
    i += character.length;
  }
  return true;
}

bool check_readable(const TextFile& file, Diagnostics& diagnostics) {
  if (!check_size(file, kMaxFileBytes, diagnostics)) return false;
  const std::size_t nul = file.content().find('\0');
  if (nul == std::string_view::npos) return true;
  diagnostics.error("invalid-character", file.locate(nul),
                    "a NUL byte must not occur in a file of XML; save the file in UTF-8");
  return false;
}

}  // namespace arbiter::rules
