#include "gateway/core/reload.hpp"

#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cerrno>
#include <exception>
#include <system_error>
#include <utility>

#include "gateway/core/say.hpp"

namespace arbiter::gateway {

bool take_signal(int descriptor) {
  signalfd_siginfo info;
  return ::read(descriptor, &info, sizeof info) == static_cast<ssize_t>(sizeof info);
}

Reload::Reload(int asked, int stop, std::function<std::unique_ptr<Setup>()> prepare)
    : asked_(asked), prepare_(std::move(prepare)), ends_(epoll_create1(EPOLL_CLOEXEC)) {
  for (const int each : {stop, changed_.descriptor()}) {
    epoll_event event{};
    event.events = EPOLLIN;
    if (epoll_ctl(ends_.get(), EPOLL_CTL_ADD, each, &event) != 0) {
      throw std::system_error(errno, std::generic_category(), "no descriptor to wait for signals");
    }
  }
}

void Reload::look() {
  if (!take_signal(asked_)) return;
  auto next = prepare_();
  if (next == nullptr) {
    say(Level::kError, "the mapping was not read again: the one before stays");
    return;
  }
  say(Level::kInfo, "the mapping was read again: the gateway begins anew with it");
  begin_anew(std::move(next));
}

void Reload::begin_anew(std::unique_ptr<Setup> next) {
  next_ = std::move(next);
  changed_.ring();
}

std::unique_ptr<Setup> Reload::take() {
  changed_.silence();
  return std::exchange(next_, nullptr);
}

}  // namespace arbiter::gateway
