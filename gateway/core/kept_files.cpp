#include "gateway/core/kept_files.hpp"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <string_view>
#include <system_error>

namespace arbiter::gateway {
namespace {

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

std::string whole_of(int descriptor) {
  struct stat is {};
  if (::fstat(descriptor, &is) != 0 || is.st_size < 0) {
    throw rules::FileError("the supervisor's copy of the mapping cannot be read");
  }
  std::string content(static_cast<std::size_t>(is.st_size), '\0');
  std::size_t at = 0;
  while (at < content.size()) {
    const ssize_t count =
        ::pread(descriptor, content.data() + at, content.size() - at, static_cast<off_t>(at));
    if (count <= 0) throw rules::FileError("the supervisor's copy of the mapping is cut short");
    at += static_cast<std::size_t>(count);
  }
  return content;
}

// Takes a part off that ends with a NUL, or has that many bytes.
std::string_view take(std::string_view& rest, std::size_t size) {
  if (size >= rest.size()) throw rules::FileError("the supervisor's copy of the mapping is cut");
  const std::string_view part = rest.substr(0, size);
  rest.remove_prefix(size + 1);
  return part;
}

}  // namespace

KeptFiles::KeptFiles(int descriptor) {
  const std::string content = whole_of(descriptor);
  for (std::string_view rest = content; !rest.empty();) {
    const std::string path(take(rest, rest.find('\0')));
    const std::string_view number = take(rest, rest.find('\0'));
    std::size_t size = 0;
    std::from_chars(number.data(), number.data() + number.size(), size);
    by_path_[path] = take(rest, size);
  }
}

ReadFile KeptFiles::from_disk(bool only_regular) {
  return [this, only_regular](const std::string& path, std::size_t limit, rules::Accept accept) {
    return by_path_[path] =
               rules::read_bytes(path, limit, only_regular ? rules::Accept::kRegularFile : accept);
  };
}

ReadFile KeptFiles::kept() const {
  return [this](const std::string& path, std::size_t /*limit*/, rules::Accept /*accept*/) {
    const auto found = by_path_.find(path);
    if (found == by_path_.end()) throw rules::FileError(path + ": the supervisor has no copy");
    return found->second;
  };
}

shm::FileDescriptor KeptFiles::in_memory() const {
  std::string content;
  for (const auto& [path, bytes] : by_path_) {
    for (const std::string& part : {path, std::to_string(bytes.size()), bytes}) {
      content.append(part).push_back('\0');
    }
  }
  shm::FileDescriptor file(::memfd_create("arbiter-mapping", 0));
  if (!file) fail("no memory for a copy of the mapping");
  for (std::string_view rest = content; !rest.empty();) {
    const ssize_t count = ::write(file.get(), rest.data(), rest.size());
    if (count <= 0) fail("no memory for a copy of the mapping");
    rest.remove_prefix(static_cast<std::size_t>(count));
  }
  return file;
}

}  // namespace arbiter::gateway
