// A program of two processes, for what its worker may do wrong.
//
//   supervised_program MODE SILENCE_MS END_MS
//
// The worker says "worker PID", and "beats" at its second beat; as MODE says, it then goes on
// ("beat"), or heeds nothing any more ("hang"). With "fail" and "crash" it ends at once, and the
// pauses between two workers are a few milliseconds. With "signalled" SIGUSR1 comes first.
#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "gateway/core/supervisor.hpp"

namespace {

using namespace arbiter::gateway;

void clean_up(int pid) { std::cout << "cleaned up after " << pid << std::endl; }

int work(const std::string& mode, const Patience& patience) {
  if (mode == "signalled") ::raise(SIGUSR1);
  const auto beat = heartbeat();
  if (!beat) return 1;
  end_with_supervisor(clean_up, patience);
  if (mode == "fail") return kHasFailed;
  if (mode == "crash") ::raise(SIGKILL);
  std::cout << "worker " << ::getpid() << std::endl;
  if (mode == "hang") {
    for (;;) ::pause();
  }
  for (int i = 0;; ++i) {
    (*beat)();
    if (i == 1) std::cout << "beats" << std::endl;
    ::usleep(10'000);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  Patience patience{std::chrono::milliseconds(std::atoi(argv[2])),
                    std::chrono::milliseconds(std::atoi(argv[3]))};
  const std::string mode = argv[1];
  if (mode == "fail" || mode == "crash") {
    patience.pause = std::chrono::milliseconds(1);
    patience.longest_pause = std::chrono::milliseconds(4);
    patience.longest_after_failure = std::chrono::milliseconds(16);
  }
  sigset_t caught;
  sigemptyset(&caught);
  sigaddset(&caught, SIGTERM);
  sigprocmask(SIG_BLOCK, &caught, nullptr);
  if (argc > 4) return work(argv[1], patience);
  std::vector<std::string> worker(argv, argv + argc);
  worker.emplace_back("--worker");
  return supervise(worker, ::signalfd(-1, &caught, SFD_CLOEXEC), clean_up, patience);
}
