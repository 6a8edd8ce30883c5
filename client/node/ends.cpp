// How a daemon learns that a node has ended, be it stopped, or gone, at that moment.
#include <linux/sockios.h>
#include <poll.h>
#include <sys/ioctl.h>

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
// Written by whoever has waited. Relaxed, with no partner: nothing else is read by it, and who
// misses it waits once more.
std::atomic<Clock::duration> last_waited_in_vain{-kNoPatienceAfter};

Clock::duration patience_at_end(Clock::time_point now) {
  const Clock::time_point in_vain(last_waited_in_vain.load(std::memory_order_relaxed));
  return now - in_vain < kNoPatienceAfter ? Clock::duration::zero() : kPatienceAtEnd;
}

// Of nodes that have ended: the others are said once these have been heard.
constexpr std::size_t kMostEndedAtOnce = 256;

bool has_hung_up(const shm::FileDescriptor& socket) {
  pollfd state{socket.get(), 0, 0};
  return ::poll(&state, 1, 0) != 0;
}

}  // namespace

bool NodeCore::is_heard() const noexcept {
  if (standing_ != Standing::kMember || socket_ == nullptr || !has_said_all()) return false;
  int unread = 0;  // bytes
  return !has_hung_up(*socket_) && ::ioctl(socket_->get(), SIOCOUTQ, &unread) == 0 && unread == 0;
}

void NodeCore::say_who_has_ended(Whom whom) noexcept {
  has_ended_to_tell_ = false;
  if (standing_ != Standing::kMember || socket_ == nullptr || !has_any_ended()) return;
  try {
    const auto board = shm::identity_of(memory_->board());
    if (ended_said_in_ != conversation_) ended_said_.clear();
    ended_said_in_ = conversation_;
    if (!ended_said_.empty() && is_heard()) {
      forget_ended(board, ended_said_);
      ended_said_.clear();
    }
    const auto ended = whom == Whom::kAll ? ended_in(board) : ended_to_tell(board, service_bell_);
    for (const std::uint64_t node : ended) {
      // To the next daemon all are said again.
      if (socket_ == nullptr || ended_said_.size() == kMostEndedAtOnce) break;
      if (ended_said_.insert(node).second) say_ended(node);
    }
    has_ended_to_tell_ = !ended.empty();
  } catch (const std::exception&) {  // no memory: another time
  }
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
    due_.clear();
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

}  // namespace arbiter::detail
