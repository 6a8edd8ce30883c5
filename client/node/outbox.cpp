#include "client/node/outbox.hpp"

#include <fcntl.h>

#include <exception>
#include <utility>

#include "shm/descendants.hpp"

namespace arbiter::detail {

void make_non_blocking(const shm::FileDescriptor& socket) noexcept {
  fcntl(socket.get(), F_SETFL, O_NONBLOCK);
}

bool Outbox::send(int socket, const wire::Message& message, Descriptors descriptors) noexcept {
  if (!waiting_.empty()) return keep(message, descriptors);
  switch (wire::send_message(socket, message, descriptors)) {
    case wire::SendResult::kSent:
    case wire::SendResult::kClosed:
      return true;
    case wire::SendResult::kTooMany:
      has_too_many_ = true;
      break;
    case wire::SendResult::kFull:
      break;
  }
  return keep(message, descriptors);
}

bool Outbox::keep(const wire::Message& message, Descriptors descriptors) noexcept try {
  if (waiting_.size() == kMostWaiting) return false;
  Waiting waiting{message, {}};
  for (std::size_t i = 0; i < descriptors.size() && descriptors[i] >= 0; ++i) {
    waiting.descriptors[i] = shm::duplicate(descriptors[i]);
    if (!waiting.descriptors[i]) return false;
    shm::close_in_children(waiting.descriptors[i]);
  }
  waiting_.push_back(std::move(waiting));
  return true;
} catch (const std::exception&) {  // no memory
  return false;
}

// A daemon's own number is in the answer to it.
bool Outbox::withdraw(std::uint64_t request) noexcept {
  const auto withdrawn = std::erase_if(waiting_, [&](const Waiting& each) {
    return each.message.request == request && each.message.kind != wire::MessageKind::kSynced;
  });
  if (waiting_.empty()) has_too_many_ = false;
  return withdrawn != 0;
}

void Outbox::flush(int socket) noexcept {
  has_too_many_ = false;
  while (!waiting_.empty()) {
    const Waiting& next = waiting_.front();
    Descriptors descriptors{};
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      descriptors[i] = next.descriptors[i] ? next.descriptors[i].get() : -1;
    }
    switch (wire::send_message(socket, next.message, descriptors)) {
      case wire::SendResult::kSent:
        waiting_.pop_front();
        break;
      case wire::SendResult::kTooMany:
        has_too_many_ = true;
        return;
      case wire::SendResult::kFull:
        return;
      case wire::SendResult::kClosed:
        waiting_.clear();
        return;
    }
  }
}

}  // namespace arbiter::detail
