#include "gateway/core/kept_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdio>
#include <string_view>
#include <system_error>

#include "shm/memory_file.hpp"

namespace arbiter::gateway {
namespace {

// Of save()d files.
constexpr std::size_t kMaxSaved = std::size_t{64} << 20;

[[noreturn]] void fail(const std::string& what) {
  throw std::system_error(errno, std::generic_category(), what);
}

std::string whole_of(int descriptor) {
  struct stat is {};
  if (::fstat(descriptor, &is) != 0 || is.st_size < 0) {
    throw rules::FileError("the copy of the mapping cannot be read");
  }
  std::string content(static_cast<std::size_t>(is.st_size), '\0');
  std::size_t at = 0;
  while (at < content.size()) {
    const ssize_t count =
        ::pread(descriptor, content.data() + at, content.size() - at, static_cast<off_t>(at));
    if (count <= 0) throw rules::FileError("the copy of the mapping is cut short");
    at += static_cast<std::size_t>(count);
  }
  return content;
}

// Takes a part off that ends with a NUL, or has that many bytes.
std::string_view take(std::string_view& rest, std::size_t size) {
  if (size >= rest.size()) throw rules::FileError("the copy of the mapping is cut");
  const std::string_view part = rest.substr(0, size);
  rest.remove_prefix(size + 1);
  return part;
}

}  // namespace

KeptFiles::KeptFiles(int descriptor) : KeptFiles(std::string_view(whole_of(descriptor))) {}

KeptFiles::KeptFiles(std::string_view content) {
  for (std::string_view rest = content; !rest.empty();) {
    const std::string path(take(rest, rest.find('\0')));
    const std::string_view number = take(rest, rest.find('\0'));
    std::size_t size = 0;
    std::from_chars(number.data(), number.data() + number.size(), size);
    by_path_[path] = take(rest, size);
  }
}

KeptFiles KeptFiles::saved(const std::string& path) {
  const std::string content = rules::read_bytes(path, kMaxSaved, rules::Accept::kRegularFile);
  if (content.size() > kMaxSaved) throw rules::FileError(path + " is too large for a copy");
  return KeptFiles(std::string_view(content));
}

ReadFile KeptFiles::from_disk(bool only_regular) {
  return [this, only_regular](const std::string& path, std::size_t limit, rules::Accept accept) {
    return by_path_[path] =
               rules::read_bytes(path, limit, only_regular ? rules::Accept::kRegularFile : accept);
  };
}

ReadFile KeptFiles::kept() const {
  return [this](const std::string& path, std::size_t limit, rules::Accept /*accept*/) {
    const auto found = by_path_.find(path);
    if (found == by_path_.end()) throw rules::FileError(path + ": there is no copy");
    return found->second.substr(0, limit + 1);  // more is too large, however much more
  };
}

std::string KeptFiles::content() const {
  std::string content;
  for (const auto& [path, bytes] : by_path_) {
    for (const std::string& part : {path, std::to_string(bytes.size()), bytes}) {
      content.append(part).push_back('\0');
    }
  }
  return content;
}

shm::FileDescriptor KeptFiles::in_memory() const {
  return shm::memory_file("arbiter-mapping", content(), 0);
}

void KeptFiles::save(const std::string& path) const {
  const std::string next = path + ".new";
  const shm::FileDescriptor file(
      ::open(next.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0600));
  if (!file) fail(next);
  if (shm::write_whole(file.get(), content()) && ::rename(next.c_str(), path.c_str()) == 0) return;
  const int error = errno;
  ::unlink(next.c_str());  // it takes room, where that is short
  errno = error;
  fail(path);
}

}  // namespace arbiter::gateway
