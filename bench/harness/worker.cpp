#include "bench/harness/worker.hpp"

#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <iostream>
#include <system_error>
#include <utility>

#include "bench/harness/interruption.hpp"

namespace arbiter::bench {
namespace {

enum Kind : std::uint64_t { kWords, kFailure };

constexpr int kPatienceMs = 120'000;

struct Frame {
  std::uint64_t kind;
  std::uint64_t size;
};

bool read_all(int fd, void* data, std::size_t size) {
  auto* at = static_cast<char*>(data);
  while (size != 0) {
    pollfd polled{fd, POLLIN, 0};
    const int ready = poll_or_throw(polled, kPatienceMs);
    if (ready < 0 && errno == EINTR) continue;
    if (ready == 0) throw BenchError("does not answer");
    const ssize_t got = ::read(fd, at, size);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    at += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

}  // namespace

void Conversation::send(std::uint64_t kind, const void* data, std::size_t size) {
  const Frame frame{kind, size};
  std::string bytes(reinterpret_cast<const char*>(&frame), sizeof frame);
  bytes.append(static_cast<const char*>(data), size);
  const char* at = bytes.data();
  for (std::size_t left = bytes.size(); left != 0;) {
    const ssize_t sent = ::send(socket_.get(), at, left, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) throw BenchError("has ended");
    at += sent;
    left -= static_cast<std::size_t>(sent);
  }
}

void Conversation::say(const std::vector<std::uint64_t>& words) {
  send(kWords, words.data(), words.size() * sizeof words[0]);
}

// Workers that were started later have a copy of the socket; closing ours would tell nobody.
void Conversation::end() { ::shutdown(socket_.get(), SHUT_RDWR); }

void Conversation::fail(std::string_view why) { send(kFailure, why.data(), why.size()); }

bool Conversation::receive(std::vector<std::uint64_t>& words) {
  Frame frame{};
  if (!read_all(socket_.get(), &frame, sizeof frame)) return false;
  if (frame.kind == kFailure) {
    std::string why(frame.size, '\0');
    if (!read_all(socket_.get(), why.data(), why.size())) return false;
    throw BenchError(why);
  }
  words.resize(frame.size / sizeof words[0]);
  return read_all(socket_.get(), words.data(), frame.size);
}

std::vector<std::uint64_t> Conversation::hear_words() {
  std::vector<std::uint64_t> words;
  if (!receive(words)) throw BenchError("has ended");
  return words;
}

bool Conversation::hear_or_end(std::uint64_t& word) {
  // The benchmark may measure others meanwhile, for as long as it takes.
  pollfd polled{socket_.get(), POLLIN, 0};
  while (::poll(&polled, 1, -1) < 0 && errno == EINTR) {
  }
  std::vector<std::uint64_t> words;
  if (!receive(words) || words.empty()) return false;
  word = words[0];
  return true;
}

Worker::Worker(std::string name, const Work& work) : name_(std::move(name)) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    throw std::system_error(errno, std::generic_category(), "socketpair");
  }
  shm::FileDescriptor ours(ends[0]);
  shm::FileDescriptor theirs(ends[1]);
  std::cout.flush();
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);
    // Ctrl-C is the benchmark's to hear; it ends its workers in order.
    ::setpgid(0, 0);
    ::signal(SIGINT, SIG_DFL);
    ::signal(SIGTERM, SIG_DFL);
    ours = {};
    Conversation with(std::move(theirs));
    try {
      work(with);
    } catch (const std::exception& error) {
      try {
        with.fail(error.what());
      } catch (const BenchError&) {  // nobody is left to be told
      }
      ::_exit(1);
    }
    // Not exit(): the benchmark's own objects are not the worker's to take down.
    ::_exit(0);
  }
  conversation_ = Conversation(std::move(ours));
}

Worker::Worker(Worker&& other) noexcept
    : name_(std::move(other.name_)),
      pid_(std::exchange(other.pid_, -1)),
      conversation_(std::move(other.conversation_)) {}

Worker& Worker::operator=(Worker&& other) noexcept {
  if (this != &other) {
    end();
    name_ = std::move(other.name_);
    pid_ = std::exchange(other.pid_, -1);
    conversation_ = std::move(other.conversation_);
  }
  return *this;
}

Worker::~Worker() { end(); }

// A worker whose conversation ends goes by itself, and takes down properly what it has; one that
// does not within two seconds is killed.
void Worker::end() noexcept {
  if (pid_ < 0) return;
  conversation_.end();
  const shm::FileDescriptor process(static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0)));
  pollfd polled{process.get(), POLLIN, 0};
  if (::poll(&polled, 1, 2000) != 1) ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

template <class Call>
auto Worker::named(Call call) {
  try {
    return call();
  } catch (const BenchError& error) {
    throw BenchError(name_ + ": " + error.what());
  }
}

void Worker::say(std::uint64_t word) {
  named([&] { conversation_.say(word); });
}
std::uint64_t Worker::hear() {
  return named([&] { return conversation_.hear(); });
}
std::vector<std::uint64_t> Worker::hear_words() {
  return named([&] { return conversation_.hear_words(); });
}
Histogram Worker::hear_histogram() {
  return named([&] { return conversation_.hear_histogram(); });
}

}  // namespace arbiter::bench
