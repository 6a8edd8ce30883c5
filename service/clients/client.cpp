#include "service/clients/client.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "service/log/event.hpp"
#include "service/log/log.hpp"
#include "service/policy/headroom.hpp"
#include "shm/assertion.hpp"
#include "shm/foreign.hpp"
#include "wire/errands.hpp"
#include "wire/hang_up.hpp"

#ifndef SO_PEERPIDFD
#define SO_PEERPIDFD 77  // Linux 6.5; older headers lack it
#endif

namespace arbiter::service {
namespace {

constexpr long kPidFsMagic = 0x50494446;  // PID_FS_MAGIC, Linux 6.9; older headers lack it

// The process at the other end. The kernel may know it by descriptor; where it is too old for that,
// its number is opened, which is sure for as long as the socket is not closed at that end.
shm::FileDescriptor open_process(int socket, pid_t pid) {
  int fd = -1;
  socklen_t size = sizeof fd;
  if (getsockopt(socket, SOL_SOCKET, SO_PEERPIDFD, &fd, &size) == 0) return shm::FileDescriptor(fd);
  return shm::FileDescriptor(static_cast<int>(syscall(SYS_pidfd_open, pid, 0)));
}

std::string too_much_waits(uid_t user) {
  return "limit-exceeded: more than " + std::to_string(wire::Errands::kMaxWaiting) +
         " descriptors of user " + std::to_string(user) +
         " wait behind others that take long to close: end the processes that have sent them, "
         "and " +
         "those at their other ends";
}

// On a file system of their own, pidfds of one process have one inode, which is no other's.
bool is_one_process(int one, int other) {
  struct statfs system {};
  struct stat first {};
  struct stat second {};
  return fstatfs(one, &system) == 0 && system.f_type == kPidFsMagic && fstat(one, &first) == 0 &&
         fstat(other, &second) == 0 && first.st_dev == second.st_dev &&
         first.st_ino == second.st_ino;
}

}  // namespace

Client::Client(ClientId id, shm::FileDescriptor socket, Shares& shares)
    : id_(id), shares_(shares), socket_(std::move(socket)) {
  const auto fail = [&](const char* what) {
    const int error = errno;
    wire::hang_up(std::move(socket_), user_);
    throw std::system_error(error, std::generic_category(), what);
  };
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(socket_.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
    fail("asking who connects");
  }
  pid_ = peer.pid;
  user_ = peer.uid;
  try {
    if (wire::Errands::of_the_process().is_stuck(user_)) throw LimitExceeded(too_much_waits(user_));
    descriptors_ = shares_.take(user_, Share::kDescriptors, kDescriptors);
  } catch (const LimitExceeded&) {
    wire::hang_up(std::move(socket_), user_);
    throw;
  }
  process_ = open_process(socket_.get(), pid_);
  if (!process_) fail("opening a client's process");
}

Client::Queued::~Queued() {
  for (auto& descriptor : descriptors) {
    wire::Errands::of_the_process().close(user, std::move(descriptor));
  }
}

Client::~Client() { wire::hang_up(std::move(socket_), user_); }

LeftUnread::Client Client::release_unread() {
  return {user_, std::move(socket_), std::move(in_flight_), std::move(descriptors_)};
}

wire::SendResult Client::try_to_send(const wire::Message& message, const Descriptors& descriptors,
                                     std::uint64_t count) {
  if (count != 0) in_flight_.look(socket_.get());
  held_back_ = !in_flight_.allows(shares_, user_, count);
  if (held_back_) return wire::SendResult::kTooMany;
  const wire::SendResult result = wire::send_message(socket_.get(), message, descriptors);
  if (result == wire::SendResult::kSent) in_flight_.add(shares_, user_, count);
  held_back_ = result == wire::SendResult::kTooMany;
  return result;
}

void Client::send(const wire::Message& message,
                  std::array<int, wire::kMaxDescriptors> descriptors) {
  if (lost_) return;
  const auto count = static_cast<std::uint64_t>(
      std::count_if(descriptors.begin(), descriptors.end(), [](int fd) { return fd >= 0; }));
  if (queue_.empty()) {
    flushed_in_vain_ = 0;
    const wire::SendResult result = try_to_send(message, descriptors, count);
    if (result == wire::SendResult::kSent) return;
    if (result == wire::SendResult::kClosed) {
      lost_ = hung_up_ = true;
      return;
    }
  }
  if (!has_room_for(count)) {
    log_event({EventKind::kGivenUp, {name}}, log::level::warn,
              "{} does not read its messages: {} wait; giving it up", description(), queue_.size());
    lost_ = true;
    return;
  }
  auto queued = std::make_unique<Queued>(user_);
  queued->message = message;
  queued->bytes = shares_.take(user_, Share::kQueue, sizeof(Queued));
  queued->open = shares_.take(user_, Share::kDescriptors, count);
  for (std::size_t i = 0; i < descriptors.size() && descriptors[i] >= 0; ++i) {
    queued->descriptors[i] = shm::duplicate(descriptors[i]);
    if (!queued->descriptors[i]) {
      log_event({EventKind::kGivenUp, {name}}, log::level::warn,
                "{} cannot be sent a message, and is given up: {} (the limit is RLIMIT_NOFILE, "
                "LimitNOFILE= in "
                "a systemd unit)",
                description(), std::strerror(errno));
      lost_ = true;
      return;
    }
  }
  queued_descriptors_ += count;  // of those that are queued: the above may give the client up
  queue_.push_back(std::move(queued));
}

bool Client::has_room_for(std::uint64_t descriptors) const {
  return queue_.size() < kMaxQueue && queued_descriptors_ < kMaxQueuedDescriptors &&
         shares_.allows(user_, Share::kQueue, sizeof(Queued)) &&
         shares_.allows(user_, Share::kDescriptors, descriptors);
}

void Client::flush() {
  ++flushed_in_vain_;
  while (!queue_.empty() && !lost_) {
    const Queued& next = *queue_.front();
    std::array<int, wire::kMaxDescriptors> descriptors{};
    for (std::size_t i = 0; i < descriptors.size(); ++i) descriptors[i] = next.descriptors[i].get();
    const auto count = static_cast<std::size_t>(
        std::count_if(descriptors.begin(), descriptors.end(), [](int fd) { return fd >= 0; }));
    const wire::SendResult result = try_to_send(next.message, descriptors, count);
    if (result == wire::SendResult::kFull || result == wire::SendResult::kTooMany) return;
    if (result == wire::SendResult::kClosed) lost_ = hung_up_ = true;
    flushed_in_vain_ = 0;
    ARBITER_ASSERT(queued_descriptors_ >= count, "more descriptors leave a queue than were in it");
    queued_descriptors_ -= count;
    queue_.pop_front();
  }
  ARBITER_ASSERT(!queue_.empty() || queued_descriptors_ == 0,
                 "an empty queue is said to have descriptors in it");
}

wire::ReceiveResult Client::receive(wire::Received& received) {
  if (!ahead_.empty()) {
    received = std::move(ahead_.front().received());
    ahead_.pop_front();
    return wire::ReceiveResult::kReceived;
  }
  if (ahead_ended_) return *ahead_ended_;
  return receive_from_socket(received);
}

// What is neither a memfd nor an anonymous pipe is not looked at. What has come by the last
// descriptors that there are is given up, lest the next message find none. Of a user who is stuck
// nothing more is received: what is unread counts against the limit of who has sent it.
wire::ReceiveResult Client::receive_from_socket(wire::Received& received) {
  wire::dispose_of(received, user_);
  if (wire::Errands::of_the_process().is_stuck(user_)) {
    log_event({EventKind::kGivenUp, {name}}, log::level::warn, "{} is given up: {}", description(),
              too_much_waits(user_));
    return wire::ReceiveResult::kClosed;
  }
  wire::ReceiveResult result{};
  {
    const Headroom::Use use;
    result = wire::receive_message(socket_.get(), received, false);
  }
  const rlim_t limit = Headroom::of_the_process().limit();
  for (auto& descriptor : received.descriptors) {
    if (!descriptor) break;
    const bool is_tame = shm::foreign_kind(descriptor.get()) != shm::ForeignKind::kOther;
    const bool is_last = static_cast<rlim_t>(descriptor.get()) >= limit;
    received.is_strange |= !is_tame;
    received.lost_descriptors |= is_last;
  }
  if (received.is_strange || received.lost_descriptors) wire::dispose_of(received, user_);
  return result;
}

void Client::read_ahead() {
  wire::Received received;
  while (!ahead_ended_ && ahead_.size() < kMaxReadAhead &&
         shares_.allows(user_, Share::kQueue, sizeof received) &&
         shares_.allows(user_, Share::kDescriptors, wire::kMaxDescriptors)) {
    const wire::ReceiveResult result = receive_from_socket(received);
    if (result == wire::ReceiveResult::kNothing) return;
    if (result == wire::ReceiveResult::kReceived) {
      ahead_.push_back(put_aside(received));
    } else {
      ahead_ended_ = result;
    }
  }
  wire::dispose_of(received, user_);
}

bool Client::take_closing_of(shm::PortInstance port) {
  const auto closing = std::find_if(ahead_.begin(), ahead_.end(), [&](const PutAside& each) {
    const wire::Message& message = each.received().message;
    return (message.kind == wire::MessageKind::kClosePort && message.port == port) ||
           (message.kind == wire::MessageKind::kNodeEnded && message.link == node);
  });
  if (closing == ahead_.end()) return false;
  // The end of the node closes others too.
  if (closing->received().message.kind == wire::MessageKind::kClosePort) ahead_.erase(closing);
  return true;
}

bool Client::has_gone() const {
  return has_died() || (ahead_ended_ && (!comes_back || is_dying()));
}

// Where it has not ended after that, its number has not been another's meanwhile.
Process Client::identity() const {
  if (!started_) {
    const std::uint64_t started = start_of_process(pid_);
    started_ = has_died() ? 0 : started;
  }
  return {pid_, *started_};
}

bool Client::is_process(pid_t pid, int process) const {
  return pid_ == pid && (pid != 0 || is_one_process(process_.get(), process));
}

bool Client::has_died() const { return has_ended(process_); }

bool Client::is_dying() const {
  const Headroom::Use use;
  return is_ending(pid_) || has_died();
}

std::string Client::description() const {
  return "node \"" + name + "\" (pid " + std::to_string(pid_) + ")";
}

}  // namespace arbiter::service
