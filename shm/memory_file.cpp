#include "shm/memory_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

namespace arbiter::shm {

bool write_whole(int file, std::string_view content) noexcept {
  for (std::string_view rest = content; !rest.empty();) {
    const ssize_t written = ::write(file, rest.data(), rest.size());
    if (written > 0) {
      rest.remove_prefix(static_cast<std::size_t>(written));
      continue;
    }
    if (written < 0 && errno == EINTR) continue;
    if (written == 0) errno = ENOSPC;  // nobody says why; there is no room, as far as one can tell
    return false;
  }
  return true;
}

FileDescriptor memory_file(const char* name, std::string_view content, unsigned flags) {
  FileDescriptor file(::memfd_create(name, flags));
  if (!file || !write_whole(file.get(), content)) {
    throw std::system_error(errno, std::generic_category(),
                            "no memory for the file " + std::string(name));
  }
  return file;
}

}  // namespace arbiter::shm
