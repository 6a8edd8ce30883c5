// A process that starts another one of the same program, the worker, and starts it again when that
// ends or hangs.
//
// Some middleware ends the process that uses it, or never returns from a call, where its own daemon
// dies. The supervisor does not touch the middleware: it only starts, watches and ends its worker.
// A worker that does not beat for kPatience is killed, unless somebody has stopped it (SIGSTOP).
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace arbiter::gateway {

inline constexpr std::chrono::milliseconds kPatience{5000};

// How a worker ends that asks for another one.
inline constexpr int kBeginsAnew = 75;

// Runs until `stop` is readable, and the worker has ended, which is asked to by SIGTERM and killed
// after three seconds. `arguments`: of the worker, which is this program; it finds its pipe in
// the environment. Returns the exit code.
// `clean_up`: what a worker that has ended may have left behind; called with its process's id.
int supervise(const std::vector<std::string>& arguments, int stop,
              const std::function<void(int)>& clean_up);

// In a worker: says that it runs. None where nobody supervises. Throttled to ten a second.
std::optional<std::function<void()>> heartbeat();

}  // namespace arbiter::gateway
