#include "shm/foreign.hpp"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <string_view>
#include <system_error>

namespace arbiter::shm {
namespace {

// Only a pipe without a name is shown so: any path begins with '/'. (F_GETPIPE_SZ would tell a pipe
// from the rest too, but waits for the pipe's lock.)
bool is_anonymous_pipe(int fd) noexcept {
  char path[32];
  char target[32];
  std::snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
  const ssize_t size = readlink(path, target, sizeof target);
  constexpr std::string_view kPrefix = "pipe:[";
  return size > 0 &&
         std::string_view(target, static_cast<std::size_t>(size)).substr(0, kPrefix.size()) ==
             kPrefix;
}

// Huge pages answer for seals too, but whoever reads a hole of theirs dies where none are left.
bool has_ordinary_pages(int fd) noexcept {
  struct statfs system {};
  return fstatfs(fd, &system) == 0 && system.f_type == TMPFS_MAGIC;
}

}  // namespace

ForeignKind foreign_kind(int fd) noexcept {
  const int flags = fcntl(fd, F_GETFL);
  if (flags < 0 || (flags & O_PATH) != 0) return ForeignKind::kOther;
  if (fcntl(fd, F_GET_SEALS) >= 0) {
    return has_ordinary_pages(fd) ? ForeignKind::kMemfd : ForeignKind::kOther;
  }
  return is_anonymous_pipe(fd) ? ForeignKind::kPipe : ForeignKind::kOther;
}

uid_t maker_of(int fd) {
  struct stat status {};
  if (fstat(fd, &status) != 0) {
    throw std::system_error(errno, std::generic_category(), "looking at a descriptor");
  }
  return status.st_uid;
}

}  // namespace arbiter::shm
