// What components say of their ports, for people: told to the daemon now and then, and to the next.
#include <algorithm>
#include <new>

#include "client/node/node_core.hpp"
#include "shm/clock.hpp"
#include "shm/utf8.hpp"

namespace arbiter::detail {
namespace {

// Of one port, between two descriptions.
constexpr shm::Nanoseconds kDescriptionInterval = 250'000'000;
constexpr std::size_t kMaxDescription = 511;

}  // namespace

// The service thread tells it, or service(): a component that describes its port a thousand times a
// second sends no more than one that does so now and then.
void NodeCore::describe(shm::PortInstance port, std::string_view text, bool is_trouble) noexcept
    try {
  text = shm::beginning_of(text.substr(0, text.find('\0')), kMaxDescription);
  {
    const std::lock_guard lock(mutex_);
    if (outputs_.count(port) + inputs_.count(port) == 0) return;
    Description& description = descriptions_[port];
    if (description.text == text && description.is_trouble == is_trouble) return;
    description.text = text;
    description.is_trouble = is_trouble;
    description.is_said = false;
  }
  service_bell_->ring();
} catch (const std::bad_alloc&) {  // then it stays as it was
}

void NodeCore::say_descriptions() noexcept {
  if (standing_ != Standing::kMember || socket_ == nullptr) return;
  const shm::Nanoseconds now = shm::monotonic_now();
  for (auto& [port, description] : descriptions_) {
    if (description.is_said || now - description.said_at < kDescriptionInterval) continue;
    wire::Message message;
    message.kind = wire::MessageKind::kDescribe;
    message.port = port;
    message.value = description.is_trouble ? 1 : 0;
    message.set_text(description.text);
    description.said_at = now;
    // What follows may say something else: it does not wait in the outbox.
    description.is_said =
        has_said_all() && wire::send_message(socket_->get(), message) == wire::SendResult::kSent;
  }
}

shm::Nanoseconds NodeCore::next_description() const noexcept {
  shm::Nanoseconds next = shm::kForever;
  if (standing_ != Standing::kMember) return next;
  for (const auto& [port, description] : descriptions_) {
    if (description.is_said) continue;
    next = std::min(next, description.said_at + kDescriptionInterval);
  }
  return next;
}

// Another daemon knows nothing of them.
void NodeCore::describe_again() noexcept {
  for (auto& [port, description] : descriptions_) {
    description.is_said = description.text.empty();
    description.said_at = 0;
  }
}

}  // namespace arbiter::detail
