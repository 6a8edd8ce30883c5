// What the node says to the daemon, without ever waiting for it but at the end.
#include <poll.h>
#include <sys/epoll.h>

#include <atomic>
#include <chrono>
#include <exception>

#include "client/node/ended_nodes.hpp"
#include "client/node/node_core.hpp"
#include "shm/segment.hpp"

namespace arbiter::detail {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPatienceAtEnd{1000};
constexpr std::chrono::seconds kNoPatienceAfter{10};
std::atomic<Clock::duration> last_waited_in_vain{-kNoPatienceAfter};

Clock::duration patience_at_end(Clock::time_point now) {
  const Clock::time_point in_vain(last_waited_in_vain.load(std::memory_order_relaxed));
  return now - in_vain < kNoPatienceAfter ? Clock::duration::zero() : kPatienceAtEnd;
}

}  // namespace

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

void NodeCore::say_ended(std::uint64_t node) noexcept {
  wire::Message message;
  message.kind = wire::MessageKind::kNodeEnded;
  message.link = node;
  say(message);
}

// Instead of all that waits, which is about a node that is no more. A daemon that is only busy is
// to hear it; one that does not listen holds up the end of one node of the process, not of each.
void NodeCore::say_the_end() noexcept {
  if (!process_.is_here() || node_ == 0) return;
  if (standing_ == Standing::kMember && socket_ != nullptr) {
    outbox_.clear();
    say_ended(node_);
    const auto begin = Clock::now();
    const auto give_up = begin + patience_at_end(begin);
    for (;;) {
      say_what_waits();
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(give_up - Clock::now());
      if (socket_ == nullptr || outbox_.empty()) break;
      if (left.count() <= 0) {
        last_waited_in_vain.store(Clock::now().time_since_epoch(), std::memory_order_relaxed);
        break;
      }
      pollfd room{socket_->get(), POLLOUT, 0};
      static_cast<void>(::poll(&room, 1, static_cast<int>(left.count())));
    }
  }
  if (is_heard()) return;
  try {
    remember_ended(shm::identity_of(memory_->board()), node_, service_bell_.get());
  } catch (const std::exception&) {  // its memory is there
  }
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
