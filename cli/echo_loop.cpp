// How long arbiter echo runs, and when it looks.
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <iostream>

#include "cli/echo.hpp"
#include "cli/live.hpp"
#include "shm/clock.hpp"

namespace arbiter::cli {
namespace {

// What has become of samples at the take, nobody rings for, nor for another model.
constexpr shm::Nanoseconds kEchoLookInterval = 100'000'000;

}  // namespace

shm::Nanoseconds end_of_echo(const EchoOptions& options, shm::Nanoseconds started) {
  return time_after(started, options.duration);
}

NodeOptions echo_node_options(const EchoOptions& options) {
  NodeOptions node = live_options(options.instance);
  node.connect_timeout = std::chrono::seconds(5);
  return node;
}

void echo_while(const EchoOptions& options, const std::function<int()>& fd,
                const shm::FileDescriptor& interrupts, EchoNews& news,
                const std::function<Looked()>& look) {
  const shm::Nanoseconds end = end_of_echo(options, shm::monotonic_now());
  // Whoever reads this may go while nothing arrives.
  pollfd ready[] = {{-1, POLLIN, 0}, {interrupts.get(), POLLIN, 0}, {STDOUT_FILENO, 0, 0}};
  for (Looked looked = look(); looked != Looked::kEnough; looked = look()) {
    std::cout.flush();
    news.tell();
    shm::Nanoseconds left = std::min(end - shm::monotonic_now(), kEchoLookInterval);
    if (left <= 0) return;
    if (looked == Looked::kMore) left = 0;
    const timespec span{left / 1'000'000'000, left % 1'000'000'000};
    ready[0].fd = fd();
    ppoll(ready, 3, &span, nullptr);
    if (ready[1].revents != 0) return;
    if ((ready[2].revents & (POLLERR | POLLHUP)) != 0) std::cout.setstate(std::ios::badbit);
    if (!std::cout) return;
  }
}

}  // namespace arbiter::cli
