#include "shm/memory_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

namespace arbiter::shm {

FileDescriptor memory_file(const char* name, std::string_view content, unsigned flags) {
  FileDescriptor file(::memfd_create(name, flags));
  for (std::string_view rest = content; file && !rest.empty();) {
    const ssize_t written = ::write(file.get(), rest.data(), rest.size());
    if (written <= 0) {
      file.reset();
    } else {
      rest.remove_prefix(static_cast<std::size_t>(written));
    }
  }
  if (!file) {
    throw std::system_error(errno, std::generic_category(),
                            "no memory for the file " + std::string(name));
  }
  return file;
}

}  // namespace arbiter::shm
