// A process that starts another one of the same program, the worker, and starts it again when that
// ends or hangs.
//
// Some middleware ends the process that uses it, or never returns from a call, where its own daemon
// dies. The supervisor does not touch the middleware: it only starts, watches and ends its worker.
// A worker that does not beat for a while is killed, unless somebody has stopped it (SIGSTOP). One
// that hangs when its supervisor dies ends itself.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace arbiter::gateway {

struct Patience {
  std::chrono::milliseconds silence{5000};  // until a worker that does not beat is killed
  std::chrono::milliseconds end{3000};      // until one is that does not end when it is asked to
  // Between two starts: this after a long life, and twice as long after each short one. Where the
  // worker itself has said what is wrong, such as a limit of the system, that will hardly change by
  // itself, and each start would fill the log with the same lines.
  std::chrono::milliseconds pause{100};
  std::chrono::milliseconds longest_pause{2000};
  std::chrono::milliseconds longest_after_failure{30'000};
};

// How a worker ends that has said what is wrong.
inline constexpr int kHasFailed = 1;

// How a worker ends that asks for another one.
inline constexpr int kBeginsAnew = 75;

// What a worker that has ended may have left behind; called with its process's id.
using CleanUp = std::function<void(int)>;

// Another worker in place of the one that runs: `renew` is called where `asked` is readable, and
// says whether it is to be so.
struct Renewal {
  int asked = -1;
  std::function<bool()> renew = [] { return false; };
};

// Runs until `stop` is readable, and the worker has ended, which is asked to by SIGTERM. The
// `arguments` are the worker's, which is this program; it finds its pipe in the environment.
// Returns the exit code.
int supervise(const std::vector<std::string>& arguments, int stop, const CleanUp& clean_up,
              const Patience& patience = {}, const Renewal& renewal = {});

// In a worker: says that it runs. None where nobody supervises.
std::optional<std::function<void()>> heartbeat();

// Waits until nobody can read what is written to the pipe any more; false: somebody can. With -1
// for as long as it takes, or until a signal comes.
[[nodiscard]] bool has_lost_its_reader(int pipe, int milliseconds);

// In a worker: a thread that kills it where its supervisor has ended, however that was, and it has
// not ended either for patience.end. It is sent SIGTERM then, but may hang, or be ending where the
// middleware hangs. Nothing, where nobody supervises.
void end_with_supervisor(const CleanUp& clean_up, const Patience& patience = {});

}  // namespace arbiter::gateway
