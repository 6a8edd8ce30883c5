// What the node says to the daemon, without ever waiting for it; what it says last is in ends.cpp.
#include <sys/epoll.h>

#include <utility>

#include "client/node/node_core.hpp"

namespace arbiter::detail {

void NodeCore::say(const wire::Message& message, Outbox::Descriptors descriptors) noexcept {
  if (socket_ == nullptr) return;
  const bool had_too_many = has_too_many();
  const bool is_said = due_.empty() ? outbox_.send(socket_->get(), message, descriptors)
                                    : outbox_.keep(message, descriptors);
  if (!is_said) return lose_daemon();
  heed();
  // Room is no news then, and whoever waits in the loop does not know when to try again.
  if (has_too_many() && !had_too_many) service_bell_->ring();
}

void NodeCore::say_what_waits() noexcept {
  if (socket_ == nullptr || has_said_all()) return;
  say_what_is_due();
  if (socket_ == nullptr) return;  // the daemon has gone
  if (due_.empty()) outbox_.flush(socket_->get());
  heed();
}

// Descriptors that have been sent to us and that we have not read may be the user's as well: where
// these are too many under way, not to hear would be to wait for ourselves.
bool NodeCore::hears() const noexcept {
  return !hands_back() && (has_too_many() || !outbox_.is_half_full());
}

void NodeCore::heed() noexcept {
  const bool awaits_room = !has_said_all() && !has_too_many();
  const std::uint32_t events = (hears() ? EPOLLIN : 0u) | (awaits_room ? EPOLLOUT : 0u);
  if (std::exchange(heeded_, events) == events) return;
  epoll_event event{};
  event.events = events;
  epoll_ctl(epoll_.get(), EPOLL_CTL_MOD, socket_->get(), &event);
}

void NodeCore::say_closed(shm::PortInstance port) noexcept {
  wire::Message message;
  message.kind = wire::MessageKind::kClosePort;
  message.port = port;
  say(message);
}

}  // namespace arbiter::detail
