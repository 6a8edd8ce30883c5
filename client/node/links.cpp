// What the daemon says of the ports at the other end: they come, grow and go.
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <system_error>
#include <utility>

#include "client/node/node_core.hpp"

namespace arbiter::detail {

// Whoever made a segment or a bell may hold its lock in the kernel: so it is looked at, and mapped,
// under no lock of ours.
void NodeCore::look_at_growth(shm::PortInstance port, const OutputPeer& peer) {
  const bool is_more = survey(peer);
  try {
    shm::make_written_resident(peer.file, peer.mapping, residence());
  } catch (const std::system_error& error) {
    say_not_locked(port, error.what());
  }
  if (is_more) wake_inputs();
}

void NodeCore::hear_of_growth(const wire::Message& message) {
  std::shared_ptr<const OutputPeer> grown;
  {
    const std::lock_guard lock(mutex_);
    const auto input = inputs_.find(message.port);
    if (input != inputs_.end()) grown = input->second->peer(message.peer);
  }
  if (grown != nullptr) look_at_growth(message.port, *grown);
}

void NodeCore::set_measured(const wire::Message& message) {
  const std::lock_guard lock(mutex_);
  const auto input = inputs_.find(message.port);
  if (input != inputs_.end()) input->second->set_measured(message.value != 0);
}

void NodeCore::add_receiver(const wire::Received& received) {
  const wire::Message& message = received.message;
  const auto type = type_of_port(message.port);
  if (!type) return;  // closed meanwhile, as it may be below
  auto receiver = map_input_peer(received, *type, residence());
  const std::lock_guard lock(mutex_);
  const auto output = outputs_.find(message.port);
  if (output == outputs_.end()) return;
  output->second->add_peer(std::move(receiver),
                           (message.flags & wire::kIsConnected) != 0 ? message.link : 0);
}

void NodeCore::add_publisher(const wire::Received& received) {
  const wire::Message& message = received.message;
  const auto type = type_of_port(message.port);
  if (!type) return;
  auto publisher = map_output_peer(received, *type, residence());
  const std::lock_guard lock(mutex_);
  const auto input = inputs_.find(message.port);
  if (input != inputs_.end()) input->second->add_peer(std::move(publisher));
}

// Not the port itself: whoever keeps it keeps this node.
std::optional<shm::TypeInfo> NodeCore::type_of_port(shm::PortInstance port) {
  const std::lock_guard lock(mutex_);
  if (const auto output = outputs_.find(port); output != outputs_.end()) {
    return output->second->type();
  }
  const auto input = inputs_.find(port);
  if (input == inputs_.end()) return {};
  return input->second->type();
}

void NodeCore::end_peer(const wire::Message& message) {
  const bool is_gone = message.kind == wire::MessageKind::kPeerGone;
  const std::lock_guard lock(mutex_);
  if (const auto output = outputs_.find(message.port); output != outputs_.end()) {
    OutputCore& core = *output->second;
    is_gone ? core.remove_tap(message.peer) : core.end_tap(message.peer);
    is_gone ? core.remove_peer(message.peer) : core.disconnect_peer(message.peer);
  }
  if (const auto input = inputs_.find(message.port); input != inputs_.end()) {
    InputCore& core = *input->second;
    is_gone ? core.lose_peer(message.peer) : core.disconnect_peer(message.peer);
  }
  if (const auto tap = taps_.find(message.port); tap != taps_.end()) {
    const bool is_told = (message.flags & wire::kTellsActivity) != 0;
    const auto word = static_cast<shm::ActivityWord>(message.link);
    if (message.peer == 0) {
      tap->second->lose_all_of(message.id);
    } else {
      tap->second->lose_source(message.peer, is_told ? std::optional(word) : std::nullopt);
      tap->second->lose_input(message.peer);
    }
  }
}

}  // namespace arbiter::detail
