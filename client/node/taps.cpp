// Taps that this node opens, and taps of its output ports.
//
// A tap is no port: nothing of it is handed back to a daemon that takes over. The node asks again,
// and whoever has been told of the tap before knows it by its segment.
#include <algorithm>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "client/node/node_core.hpp"

namespace arbiter::detail {

void NodeCore::handle_about_tap(wire::Received& received) {
  const wire::Message& message = received.message;
  if (message.kind == wire::MessageKind::kTapAway) {
    const std::lock_guard lock(mutex_);
    const auto output = outputs_.find(message.port);
    if (output != outputs_.end()) output->second->doubt_tap(message.peer);
    return;
  }
  try {
    switch (message.kind) {
      case wire::MessageKind::kTap:
        add_tap(received);
        break;
      case wire::MessageKind::kTapInput:
        add_tap_input(received);
        break;
      default:
        add_tap_source(received);
    }
  } catch (const std::exception& error) {
    refuse_tap(message, error.what());
  }
}

void NodeCore::add_tap(const wire::Received& received) {
  const wire::Message& message = received.message;
  auto tap = map_tap_peer(received, residence());
  const std::lock_guard lock(mutex_);
  const auto output = outputs_.find(message.port);
  if (output == outputs_.end()) return;  // closed meanwhile
  const OutputCore::TapEntry entry = output->second->add_tap(std::move(tap));
  wire::Message answer;
  answer.kind = wire::MessageKind::kTapped;
  answer.port = message.port;
  answer.peer = message.peer;
  answer.link = entry.link;
  answer.value = entry.place;
  say(answer, {entry.memory->readable().get(), -1});
}

void NodeCore::add_tap_source(const wire::Received& received) {
  const wire::Message& message = received.message;
  std::optional<shm::TypeInfo> type;
  {
    const std::lock_guard lock(mutex_);
    const auto tap = taps_.find(message.port);
    if (tap != taps_.end()) type = tap->second->type();
  }
  if (!type) return;
  auto source = map_tap_source(received, *type, residence());
  const std::lock_guard lock(mutex_);
  const auto tap = taps_.find(message.port);
  if (tap != taps_.end()) tap->second->add_source(std::move(source));
}

void NodeCore::add_tap_input(const wire::Received& received) {
  auto input = map_tap_input(received, residence());
  const std::lock_guard lock(mutex_);
  const auto tap = taps_.find(received.message.port);
  if (tap != taps_.end()) tap->second->add_input(std::move(input));
}

// The publisher tells the daemon, which tells the tap; a tap tells its program.
void NodeCore::refuse_tap(const wire::Message& announced, const std::string& why) {
  const std::lock_guard lock(mutex_);
  if (announced.kind == wire::MessageKind::kTap) {
    say_refused(announced.port, announced.peer, why);
    return;
  }
  wire::Message refusal = announced;
  refusal.set_text(why);
  static_cast<void>(note_tap_refusal(refusal));
}

// Where the only source refuses a tap that is being opened, that fails.
bool NodeCore::note_tap_refusal(const wire::Message& refusal) {
  const auto tap = taps_.find(refusal.port);
  if (tap == taps_.end()) return false;
  const std::string source(refusal.name_view());
  const std::string text = source + " cannot be watched: " + std::string(refusal.text_view());
  for (auto& [request, reply] : replies_) {
    if (reply.opened != refusal.port || tap->second->options().of == TapOf::input) continue;
    reply.refusal = text;
    return true;
  }
  note(NoticeKind::refused, refusal.port, source, text);
  return true;
}

void NodeCore::tidy_taps(
    std::vector<std::pair<shm::PortInstance, std::shared_ptr<const OutputPeer>>>& copied_from) {
  for (auto& [instance, tap] : taps_) {
    tap->tidy();
    for (const std::string& source : tap->misbehaving()) {
      note(NoticeKind::refused, instance, source,
           source + " cannot be watched: it writes an event that no honest publisher writes");
    }
    for (auto& peer : tap->copied_from()) copied_from.emplace_back(instance, std::move(peer));
  }
}

// A daemon that has begun anew may give one of them the number that another had before: until they
// have theirs, they have numbers that no daemon gives.
void NodeCore::forget_numbers_of_taps() {
  std::map<shm::PortInstance, std::shared_ptr<TapCore>> taps;
  shm::PortInstance none = UINT64_MAX;
  for (auto& [instance, tap] : taps_) {
    tap->bind(none);
    taps.emplace(none--, std::move(tap));
  }
  taps_.swap(taps);
}

// Those whose opening is under way are asked for again by who waits for it.
void NodeCore::reopen_taps() {
  reopened_.clear();
  forget_numbers_of_taps();
  if (socket_ == nullptr) return;  // the next daemon is asked
  for (const auto& [instance, tap] : taps_) {
    if (!tap->is_open) continue;
    const std::uint64_t request = next_request_++;
    reopened_[request] = tap;
    due_.push_back({wire::MessageKind::kOpenTap, instance, 0, request});
  }
}

// The tap is not taken hold of: its program may let go of it just now, and whoever has it last ends
// it, and with it, it may be, this node.
bool NodeCore::handle_tap_reopened(const wire::Message& message) {
  const auto found = reopened_.find(message.request);
  if (found == reopened_.end()) return false;
  const auto known = std::find_if(taps_.begin(), taps_.end(), [&](const auto& each) {
    const std::shared_ptr<TapCore>& tap = each.second;
    return !found->second.owner_before(tap) && !tap.owner_before(found->second);
  });
  if (message.kind == wire::MessageKind::kOpened) {
    if (known == taps_.end()) {  // closed meanwhile
      say_closed(message.port);
      return true;
    }
    auto tap = taps_.extract(known);
    tap.key() = message.port;
    tap.mapped()->bind(message.port);
    taps_.insert(std::move(tap));
    return true;
  }
  if (message.kind == wire::MessageKind::kRefused && known != taps_.end()) {
    const TapCore& tap = *known->second;
    note(NoticeKind::refused, tap.instance(), tap.name(),
         tap.name() + " is not watched any more: " + std::string(message.text_view()));
  }
  reopened_.erase(found);
  return true;
}

}  // namespace arbiter::detail
