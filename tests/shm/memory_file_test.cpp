// Writing a file, whatever the kernel makes of it.
#include "shm/memory_file.hpp"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <optional>
#include <string>

namespace {

// What the next write gives back instead of writing; a negative number is an error's.
std::optional<ssize_t> next_write;

}  // namespace

// In the place of the C library's, for this program: a signal, or a file that takes nothing.
extern "C" ssize_t write(int file, const void* data, size_t size) {
  using Write = ssize_t (*)(int, const void*, size_t);
  static const auto next = reinterpret_cast<Write>(::dlsym(RTLD_NEXT, "write"));
  if (!next_write) return next(file, data, size);
  const ssize_t given = *next_write;
  next_write.reset();
  if (given >= 0) return given;
  errno = static_cast<int>(-given);
  return -1;
}

namespace arbiter::shm {
namespace {

std::string content_of(const FileDescriptor& file) {
  char text[64];
  const ssize_t size = ::pread(file.get(), text, sizeof text, 0);
  return {text, static_cast<std::size_t>(size)};
}

TEST(MemoryFile, ASignalDoesNotKeepItFromBeingWritten) {
  next_write = -EINTR;
  EXPECT_EQ(content_of(memory_file("arbiter-test", "all of it")), "all of it");
}

TEST(MemoryFile, SaysWhyAFileTookNothing) {
  const FileDescriptor file = memory_file("arbiter-test", "");
  next_write = 0;
  errno = EINTR;  // of something before
  EXPECT_FALSE(write_whole(file.get(), "text"));
  EXPECT_EQ(errno, ENOSPC);
  next_write = -EFBIG;
  EXPECT_FALSE(write_whole(file.get(), "text"));
  EXPECT_EQ(errno, EFBIG);
}

}  // namespace
}  // namespace arbiter::shm
