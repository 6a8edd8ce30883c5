#include "gateway/core/supervisor.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <utility>

#include "gateway/core/say.hpp"
#include "shm/clock.hpp"
#include "shm/file_descriptor.hpp"
#include "watch/process.hpp"

namespace arbiter::gateway {
namespace {

constexpr const char* kPipe = "ARBITER_GATEWAY_HEARTBEAT";
constexpr shm::Nanoseconds kSecond = 1'000'000'000;
constexpr shm::Nanoseconds kGrace = 3 * kSecond;
// Between two starts: at once after a long life, and ever more patiently after short ones.
constexpr shm::Nanoseconds kLongLife = 10 * kSecond;
constexpr shm::Nanoseconds kFirstPause = kSecond / 10;
constexpr shm::Nanoseconds kLongestPause = 2 * kSecond;

struct Worker {
  pid_t pid = -1;
  shm::FileDescriptor heart;  // readable when it beats; at its end when it has ended
  shm::Nanoseconds started = 0;
  shm::Nanoseconds beat = 0;
};

// Between fork() and exec() only what is safe there: no allocation.
Worker start(const std::vector<std::string>& arguments) {
  int ends[2];
  Worker worker;
  if (::pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0) return worker;
  worker.heart.reset(ends[0]);
  const shm::FileDescriptor theirs(ends[1]);
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (const std::string& each : arguments) argv.push_back(const_cast<char*>(each.c_str()));
  argv.push_back(nullptr);
  const std::string pipe = kPipe + ("=" + std::to_string(theirs.get()));
  std::vector<char*> environment;
  for (char** each = environ; *each != nullptr; ++each) {
    if (!std::string_view(*each).starts_with(kPipe)) environment.push_back(*each);
  }
  environment.push_back(const_cast<char*>(pipe.c_str()));
  environment.push_back(nullptr);
  const pid_t parent = ::getpid();
  worker.pid = ::fork();
  if (worker.pid == 0) {
    ::fcntl(theirs.get(), F_SETFD, 0);
    // It ends with its supervisor, however that ends.
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(0);
    sigset_t none;
    sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    ::execve("/proc/self/exe", argv.data(), environment.data());
    ::_exit(127);
  }
  worker.started = worker.beat = shm::monotonic_now();
  return worker;
}

std::string describe(int status) {
  if (WIFSIGNALED(status)) {
    return "was ended by signal " + std::to_string(WTERMSIG(status)) + " (" +
           ::strsignal(WTERMSIG(status)) + ")";
  }
  return "ended with exit code " + std::to_string(WEXITSTATUS(status));
}

// Empty: it lives.
std::optional<int> status_of(const Worker& worker) {
  int status = 0;
  return ::waitpid(worker.pid, &status, WNOHANG) == worker.pid ? std::optional(status)
                                                               : std::nullopt;
}

int milliseconds_until(shm::Nanoseconds time) {
  const shm::Nanoseconds left = time - shm::monotonic_now();
  return static_cast<int>(std::clamp<shm::Nanoseconds>(left / 1'000'000 + 1, 0, 60'000));
}

bool is_readable(int descriptor, int milliseconds) {
  pollfd one{descriptor, POLLIN, 0};
  return ::poll(&one, 1, milliseconds) > 0 && one.revents != 0;
}

void end(Worker& worker) {
  ::kill(worker.pid, SIGTERM);
  ::kill(worker.pid, SIGCONT);
  const shm::Nanoseconds give_up = shm::monotonic_now() + kGrace;
  while (!status_of(worker)) {
    if (shm::monotonic_now() >= give_up) {
      say(Level::kWarning, "the worker did not end for three seconds, and is killed");
      ::kill(worker.pid, SIGKILL);
      ::waitpid(worker.pid, nullptr, 0);
      return;
    }
    ::poll(nullptr, 0, 10);
  }
}

// Returns what became of it; empty: `stop` is readable.
std::optional<int> watch_over(Worker& worker, int stop) {
  for (;;) {
    const shm::Nanoseconds patience = std::chrono::nanoseconds(kPatience).count();
    pollfd ends[2] = {{worker.heart.get(), POLLIN, 0}, {stop, POLLIN, 0}};
    ::poll(ends, 2, std::min(milliseconds_until(worker.beat + patience), 1000));
    if (ends[1].revents != 0) return {};
    char beats[64];
    if (::read(worker.heart.get(), beats, sizeof beats) > 0) worker.beat = shm::monotonic_now();
    if (const auto status = status_of(worker)) return status;
    if ((ends[0].revents & POLLHUP) != 0) ::poll(nullptr, 0, 1);  // it is about to end
    if (shm::monotonic_now() - worker.beat < patience) continue;
    worker.beat = shm::monotonic_now();
    if (watch::is_stopped(worker.pid)) continue;
    say(Level::kError, "the worker hangs (for " + std::to_string(kPatience.count() / 1000) +
                           " s nothing has come of it), and is killed");
    ::kill(worker.pid, SIGKILL);
  }
}

}  // namespace

int supervise(const std::vector<std::string>& arguments, int stop,
              const std::function<void(int)>& clean_up) {
  shm::Nanoseconds pause = kFirstPause;
  for (;;) {
    Worker worker = start(arguments);
    if (worker.pid < 0) {
      say(Level::kError, std::string("no worker can be started: ") + std::strerror(errno));
    } else {
      const auto status = watch_over(worker, stop);
      if (!status) {
        end(worker);
        clean_up(worker.pid);
        return 0;
      }
      clean_up(worker.pid);
      const bool has_said = WIFEXITED(*status) && WEXITSTATUS(*status) == kBeginsAnew;
      if (!has_said) {
        say(Level::kWarning, "the worker " + describe(*status) + "; another one is started");
      }
    }
    const bool lived_long = shm::monotonic_now() - worker.started > kLongLife;
    pause = lived_long ? kFirstPause : std::min(2 * pause, kLongestPause);
    if (is_readable(stop, static_cast<int>(pause / 1'000'000))) return 0;
  }
}

std::optional<std::function<void()>> heartbeat() {
  const char* const pipe = std::getenv(kPipe);
  if (pipe == nullptr) return {};
  int descriptor = -1;
  std::from_chars(pipe, pipe + std::strlen(pipe), descriptor);
  if (descriptor < 0 || ::fcntl(descriptor, F_SETFD, FD_CLOEXEC) != 0) return {};
  ::fcntl(descriptor, F_SETFL, O_NONBLOCK);
  return [descriptor] { static_cast<void>(!::write(descriptor, ".", 1)); };
}

}  // namespace arbiter::gateway
