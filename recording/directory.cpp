#include "recording/directory.hpp"

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "recording/mcap.hpp"

namespace arbiter::recording {
namespace {

// 0, or errno. Some file systems, such as NFS, cannot rename so, but link.
int rename_without_replacing(const char* from, const char* to) {
  if (::renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
  if (::link(from, to) != 0) return errno;
  return ::unlink(from) == 0 ? 0 : errno;
}

}  // namespace

int sync_directory_of(const std::string& path) {
  const std::size_t slash = path.find_last_of('/');
  std::string directory = ".";
  if (slash != std::string::npos) directory = slash == 0 ? "/" : path.substr(0, slash);
  const int fd = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return errno == EACCES ? 0 : errno;  // who may not list it can do no more
  // Some file systems cannot do it, and need not.
  const int error = ::fsync(fd) == 0 || errno == EINVAL ? 0 : errno;
  ::close(fd);
  return error;
}

bool move_to_new(const std::string& from, const std::string& to) {
  int error = rename_without_replacing(from.c_str(), to.c_str());
  if (error == EEXIST) return false;
  if (error == 0) error = sync_directory_of(to);
  if (error == 0) return true;
  throw McapError("cannot create " + to + ": " + std::strerror(error));
}

}  // namespace arbiter::recording
