#include "drawing/graphviz.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "shm/file_descriptor.hpp"

namespace arbiter::drawing {
namespace {

struct Pipe {
  Pipe() {
    std::array<int, 2> ends;
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("cannot make a pipe");
    read = shm::FileDescriptor(ends[0]);
    write = shm::FileDescriptor(ends[1]);
  }
  shm::FileDescriptor read, write;
};

struct FileActions {
  FileActions() { posix_spawn_file_actions_init(&actions); }
  ~FileActions() { posix_spawn_file_actions_destroy(&actions); }
  FileActions(const FileActions&) = delete;
  FileActions& operator=(const FileActions&) = delete;
  posix_spawn_file_actions_t actions{};
};

// Ends with this, unless somebody has waited for its end.
class Child {
 public:
  explicit Child(pid_t pid) : pid_(pid) {}
  ~Child() {
    if (pid_ < 0) return;
    kill(pid_, SIGKILL);
    static_cast<void>(wait());
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  [[nodiscard]] int wait() {
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return status;
  }

 private:
  pid_t pid_;
};

pid_t start(const std::string& format, const Pipe& in, const Pipe& out, const Pipe& err) {
  FileActions files;
  posix_spawn_file_actions_adddup2(&files.actions, in.read.get(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files.actions, out.write.get(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files.actions, err.write.get(), STDERR_FILENO);
  std::string program = "dot", option = "-T" + format;
  std::array<char*, 3> arguments{program.data(), option.data(), nullptr};
  pid_t child = -1;
  const int error = posix_spawnp(&child, "dot", &files.actions, nullptr, arguments.data(), environ);
  if (error == ENOENT) {
    throw std::runtime_error(
        "Graphviz's program dot is needed to draw, and is not installed: apt install graphviz, or "
        "give --format dot, which does without it");
  }
  if (error != 0) throw std::runtime_error(std::string("cannot run dot: ") + std::strerror(error));
  return child;
}

// Reads what there is; false at the end.
bool drain(shm::FileDescriptor& from, std::string& text) {
  std::array<char, 65536> buffer;
  const ssize_t count = read(from.get(), buffer.data(), buffer.size());
  if (count < 0 && errno == EINTR) return true;
  if (count <= 0) return false;
  text.append(buffer.data(), static_cast<std::size_t>(count));
  return true;
}

// All three at once: dot may write before it has read everything. SIGPIPE is ignored by the
// program.
void exchange(std::string_view input, Pipe& in, std::string& output, Pipe& out, std::string& errors,
              Pipe& err, const Waiting& waiting) {
  while (out.read || err.read) {
    std::array<pollfd, 3> polled{
        {{in.write.get(), POLLOUT, 0}, {out.read.get(), POLLIN, 0}, {err.read.get(), POLLIN, 0}}};
    const int ready = poll(polled.data(), polled.size(), static_cast<int>(waiting.period.count()));
    if (ready < 0 && errno != EINTR) break;
    if (ready == 0) waiting.tell();
    if (ready <= 0) continue;
    if (polled[0].revents != 0) {
      // A piece that fits into an empty pipe, so that a write does not block for long.
      const ssize_t count =
          write(in.write.get(), input.data(), std::min<std::size_t>(input.size(), 4096));
      if (count > 0) input.remove_prefix(static_cast<std::size_t>(count));
      if ((count < 0 && errno != EINTR) || input.empty()) in.write.reset();
    }
    if (polled[1].revents != 0 && !drain(out.read, output)) out.read.reset();
    if (polled[2].revents != 0 && !drain(err.read, errors)) err.read.reset();
  }
}

}  // namespace

Layout lay_out(const std::string& dot, const std::string& format, const Waiting& waiting) {
  Pipe in, out, err;
  Child child(start(format, in, out, err));
  in.read.reset();
  out.write.reset();
  err.write.reset();
  std::string picture, errors;
  exchange(dot, in, picture, out, errors, err, waiting);
  in.write.reset();
  const int status = child.wait();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || picture.empty()) {
    throw std::runtime_error("dot could not draw this: " + errors);
  }
  return {std::move(picture), errors.find("too large for cairo") != std::string::npos};
}

}  // namespace arbiter::drawing
