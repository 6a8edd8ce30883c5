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
#include <thread>

#include "gateway/core/life_signs.hpp"
#include "gateway/core/say.hpp"
#include "shm/clock.hpp"
#include "shm/file_descriptor.hpp"
#include "watch/process.hpp"

namespace arbiter::gateway {
namespace {

constexpr const char* kPipe = "ARBITER_GATEWAY_HEARTBEAT";
constexpr shm::Nanoseconds kSecond = 1'000'000'000;
constexpr shm::Nanoseconds kLongLife = 10 * kSecond;

struct Worker {
  pid_t pid = -1;
  shm::FileDescriptor heart;  // readable when it beats; at its end when it has ended
  shm::Nanoseconds started = 0;
};

// Between fork() and exec() only what is safe there: no allocation.
Worker start(const std::vector<std::string>& arguments) {
  int ends[2];
  Worker worker;
  worker.started = shm::monotonic_now();
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
    // Who asks a service to read its mapping again may signal all of its processes. A worker leaves
    // that to us, from its first instruction on.
    ::signal(SIGUSR1, SIG_IGN);
    sigset_t none;
    sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    ::execve("/proc/self/exe", argv.data(), environment.data());
    ::_exit(127);
  }
  return worker;
}

std::string describe(int status) {
  if (WIFSIGNALED(status)) {
    return "was ended by signal " + std::to_string(WTERMSIG(status)) + " (" +
           ::strsignal(WTERMSIG(status)) + ")";
  }
  return "ended with exit code " + std::to_string(WEXITSTATUS(status));
}

bool ends_with(const std::optional<int>& status, int exit_code) {
  return status && WIFEXITED(*status) && WEXITSTATUS(*status) == exit_code;
}

// Empty: it lives.
std::optional<int> status_of(const Worker& worker) {
  int status = 0;
  return ::waitpid(worker.pid, &status, WNOHANG) == worker.pid ? std::optional(status)
                                                               : std::nullopt;
}

bool is_readable(int descriptor, int milliseconds) {
  pollfd one{descriptor, POLLIN, 0};
  return ::poll(&one, 1, milliseconds) > 0 && one.revents != 0;
}

std::string in_words(std::chrono::milliseconds time) {
  const auto count = time.count();
  return count % 1000 == 0 ? std::to_string(count / 1000) + " s" : std::to_string(count) + " ms";
}

void end(Worker& worker, const Patience& patience) {
  ::kill(worker.pid, SIGTERM);
  ::kill(worker.pid, SIGCONT);
  const shm::Nanoseconds give_up =
      shm::monotonic_now() + std::chrono::nanoseconds(patience.end).count();
  while (!status_of(worker)) {
    if (shm::monotonic_now() >= give_up) {
      say(Level::kWarning,
          "the worker did not end within " + in_words(patience.end) + ": killing it");
      ::kill(worker.pid, SIGKILL);
      ::waitpid(worker.pid, nullptr, 0);
      return;
    }
    ::poll(nullptr, 0, 10);
  }
}

// Why it is watched no longer: what became of it; or else `stop` is readable, or there is to be
// another one.
struct EndOfWatch {
  std::optional<int> status{};
  bool is_renewed = false;
};

EndOfWatch watch_over(const Worker& worker, int stop, const Patience& patience,
                      const Renewal& renewal) {
  LifeSigns signs(std::chrono::nanoseconds(patience.silence).count(), shm::monotonic_now());
  const auto look_again = static_cast<int>(patience.silence.count() / 5);
  bool left_alone = false;
  const auto is_stopped = [&] {
    const bool stopped = watch::is_stopped(worker.pid);
    if (stopped && !left_alone) {
      say(Level::kWarning, "the worker is stopped: it is left alone until it goes on");
    }
    return left_alone = stopped;
  };
  for (;;) {
    pollfd ends[3] = {
        {worker.heart.get(), POLLIN, 0}, {stop, POLLIN, 0}, {renewal.asked, POLLIN, 0}};
    ::poll(ends, 3, look_again);
    if (ends[1].revents != 0) return {};
    if (ends[2].revents != 0 && renewal.renew()) return {{}, true};
    const shm::Nanoseconds now = shm::monotonic_now();
    char beats[64];
    if (::read(worker.heart.get(), beats, sizeof beats) > 0) signs.beat(now);
    if (const auto status = status_of(worker)) return {status};
    if ((ends[0].revents & POLLHUP) != 0) ::poll(nullptr, 0, 1);  // it is about to end
    if (!signs.hangs(now, is_stopped)) continue;
    say(Level::kError,
        "the worker hangs (no sign of life for " + in_words(patience.silence) + "): killing it");
    ::kill(worker.pid, SIGKILL);
    signs.beat(now);
  }
}

// Of the pipe that the supervisor reads; negative: there is none.
int heart() {
  const char* const pipe = std::getenv(kPipe);
  int descriptor = -1;
  if (pipe != nullptr) std::from_chars(pipe, pipe + std::strlen(pipe), descriptor);
  if (descriptor < 0 || ::fcntl(descriptor, F_SETFD, FD_CLOEXEC) != 0) return -1;
  ::fcntl(descriptor, F_SETFL, O_NONBLOCK);
  return descriptor;
}

// Before the next worker, which has the newest mapping in any case. True: `stop` is readable.
bool waits_out(std::chrono::milliseconds pause, int stop, const Renewal& renewal) {
  const shm::Nanoseconds until = shm::monotonic_now() + std::chrono::nanoseconds(pause).count();
  for (;;) {
    const shm::Nanoseconds left = (until - shm::monotonic_now()) / 1'000'000;
    if (left <= 0) return is_readable(stop, 0);
    pollfd ends[2] = {{stop, POLLIN, 0}, {renewal.asked, POLLIN, 0}};
    ::poll(ends, 2, static_cast<int>(left));
    if (ends[0].revents != 0) return true;
    if (ends[1].revents != 0 && renewal.renew()) return false;
  }
}

}  // namespace

int supervise(const std::vector<std::string>& arguments, int stop, const CleanUp& clean_up,
              const Patience& patience, const Renewal& renewal) {
  std::chrono::milliseconds pause = patience.pause;
  for (;;) {
    Worker worker = start(arguments);
    std::optional<int> status;
    if (worker.pid < 0) {
      say(Level::kError, std::string("no worker can be started: ") + std::strerror(errno));
    } else {
      const EndOfWatch end_of_watch = watch_over(worker, stop, patience, renewal);
      status = end_of_watch.status;
      if (!status) end(worker, patience);
      clean_up(worker.pid);
      if (end_of_watch.is_renewed) {
        pause = patience.pause;
        continue;
      }
      if (!status) return 0;
    }
    const bool lived_long = shm::monotonic_now() - worker.started > kLongLife;
    pause = lived_long
                ? patience.pause
                : std::min(2 * pause, ends_with(status, kHasFailed) ? patience.longest_after_failure
                                                                    : patience.longest_pause);
    if (status && !ends_with(status, kBeginsAnew)) {
      say(Level::kWarning,
          "the worker " + describe(*status) + "; another one is started in " + in_words(pause));
    }
    if (waits_out(pause, stop, renewal)) return 0;
  }
}

std::optional<std::function<void()>> heartbeat() {
  const int descriptor = heart();
  if (descriptor < 0) return {};
  return [descriptor] { static_cast<void>(!::write(descriptor, ".", 1)); };
}

// Waits only for POLLERR.
bool has_lost_its_reader(int pipe, int milliseconds) {
  pollfd end{pipe, 0, 0};
  return ::poll(&end, 1, milliseconds) > 0;
}

void end_with_supervisor(const CleanUp& clean_up, const Patience& patience) {
  const int descriptor = heart();
  if (descriptor < 0) return;
  std::thread([=] {
    while (!has_lost_its_reader(descriptor, -1)) continue;
    ::poll(nullptr, 0, static_cast<int>(patience.end.count()));
    say(Level::kError, "the supervisor has ended, but the worker did not end within " +
                           in_words(patience.end) + ": killing it");
    clean_up(::getpid());
    finish_saying();
    ::kill(::getpid(), SIGKILL);
  }).detach();
}

}  // namespace arbiter::gateway
