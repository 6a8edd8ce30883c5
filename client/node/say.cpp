// What the node says to the daemon, without ever waiting for it; what it says last is in ends.cpp.
#include <sys/epoll.h>

#include "client/node/node_core.hpp"

namespace arbiter::detail {

void NodeCore::say(const wire::Message& message, Outbox::Descriptors descriptors) noexcept {
  if (socket_ == nullptr) return;
  const bool waited = !outbox_.empty();
  if (!outbox_.send(socket_->get(), message, descriptors)) return lose_daemon();
  if (!waited && !outbox_.empty()) heed_room(true);
}

void NodeCore::say_what_waits() noexcept {
  if (socket_ == nullptr || outbox_.empty()) return;
  if (!outbox_.flush(socket_->get())) return lose_daemon();
  if (outbox_.empty()) heed_room(false);
}

void NodeCore::heed_room(bool is_wanted) const noexcept {
  epoll_event event{};
  event.events = EPOLLIN | (is_wanted ? EPOLLOUT : 0u);
  epoll_ctl(epoll_.get(), EPOLL_CTL_MOD, socket_->get(), &event);
}

void NodeCore::say_closed(shm::PortInstance port) noexcept {
  wire::Message message;
  message.kind = wire::MessageKind::kClosePort;
  message.port = port;
  say(message);
}

}  // namespace arbiter::detail
