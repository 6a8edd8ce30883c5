// What a new daemon is handed back, and the taps that it is asked for again: each is said when the
// socket has room for it, before all that waits in the outbox.
//
// Invariants:
//   1. What is due is known by its number alone, and looked up at its turn: of a port that has
//      closed by then nothing is said, and no descriptor is ever copied, however many there are.
//   2. Until the daemon has been handed back all, nothing that it says is heard (hears()), and no
//      page is tried again. So meanwhile no port opens, neither pages nor links change, and its
//      answers come in order.
//   3. What is said meanwhile, such as that a port has closed, waits in the outbox (say()).
//   4. It is due in this conversation: be_alone() forgets it, and rejoin() begins anew.
#include <utility>

#include "client/node/node_core.hpp"
#include "shm/clock.hpp"

namespace arbiter::detail {
namespace {

using Descriptors = Outbox::Descriptors;

// How long a node with too many descriptors under way keeps to one conversation.
constexpr shm::Nanoseconds kMostHandBack = 1'000'000'000;

template <class Core>
void put_port_into_words(const Core& core, std::uint32_t id, const shm::FileDescriptor& second,
                         wire::Message& message, Descriptors& descriptors) {
  message.id = id;
  message.type = core.type();
  message.set_name(core.name());
  descriptors = {core.segment_descriptor().get(), second.get()};
}

}  // namespace

void NodeCore::begin_to_hand_back() {
  std::deque<Due> due{{wire::MessageKind::kHello}};
  for (const auto& page : memory_->pages_at_hand()) {
    due.push_back({wire::MessageKind::kHandBackPage, 0, page.source, page.number, page.descriptor});
  }
  const auto add = [&](wire::MessageKind kind, const auto& ports) {
    for (const auto& [instance, core] : ports) {
      due.push_back({kind, instance});
      for (const HeldLink& link : core->held_links()) {
        due.push_back({wire::MessageKind::kHandBackLink, instance, link.peer, link.number});
      }
    }
  };
  add(wire::MessageKind::kHandBackOutput, outputs_);
  add(wire::MessageKind::kHandBackInput, inputs_);
  due.push_back({wire::MessageKind::kHandedBack});
  due_.swap(due);
  // Who has no ports left may be the last that has the memory, and with it what is active, and
  // which model is in force.
  has_no_ports_ = outputs_.empty() && inputs_.empty();
  for (const auto& [instance, core] : inputs_) core->set_measured(false);  // unless it says so
}

bool NodeCore::put_into_words(const Due& due, wire::Message& message,
                              Descriptors& descriptors) const noexcept {
  message.kind = due.kind;
  message.port = due.port;
  switch (due.kind) {
    case wire::MessageKind::kHello:
      message = hello();
      message.flags |= wire::kRejoins | (has_no_ports_ ? wire::kHasNoPorts : 0u);
      descriptors = {memory_->board().get(), memory_->registry().get()};
      return true;
    case wire::MessageKind::kHandBackPage:
      message.id = static_cast<shm::SourceId>(due.about);
      message.value = static_cast<shm::PageNumber>(due.number);
      descriptors[0] = due.descriptor;
      return true;
    case wire::MessageKind::kHandBackOutput: {
      const auto output = outputs_.find(due.port);
      if (output == outputs_.end()) return false;
      const OutputCore& core = *output->second;
      put_port_into_words(core, core.source(), core.page_descriptor(), message, descriptors);
      if (core.yields()) message.flags = wire::kYields;
      return true;
    }
    case wire::MessageKind::kHandBackInput: {
      const auto input = inputs_.find(due.port);
      if (input == inputs_.end()) return false;
      const InputCore& core = *input->second;
      put_port_into_words(core, core.port(), core.bell().for_publishers(), message, descriptors);
      return true;
    }
    case wire::MessageKind::kHandBackLink:
      message.peer = due.about;
      message.link = due.number;
      return outputs_.contains(due.port) || inputs_.contains(due.port);
    case wire::MessageKind::kOpenTap: {
      const auto tap = taps_.find(due.port);
      if (tap == taps_.end()) return false;
      const TapCore& core = *tap->second;
      message.port = 0;
      message.request = due.number;
      message.flags = wire::kRejoins | (core.options().of == TapOf::input ? wire::kTapsInput : 0u);
      message.set_name(core.name());
      descriptors = {core.segment_descriptor().get(), core.bell().for_publishers().get()};
      return true;
    }
    default:  // kHandedBack
      return true;
  }
}

void NodeCore::say_what_is_due() noexcept {
  due_has_too_many_ = false;
  while (!due_.empty()) {
    wire::Message message;
    Descriptors descriptors{-1, -1};
    if (put_into_words(due_.front(), message, descriptors)) {
      switch (wire::send_message(socket_->get(), message, descriptors)) {
        case wire::SendResult::kSent:
          break;
        case wire::SendResult::kTooMany:
          due_has_too_many_ = true;
          // What nodes that hand back have not read yet may be what is too many.
          if (hands_back() && shm::monotonic_now() - asked_ > kMostHandBack) lose_daemon();
          return;
        case wire::SendResult::kFull:
          return;
        case wire::SendResult::kClosed:
          return lose_daemon();
      }
    }
    due_.pop_front();
  }
}

}  // namespace arbiter::detail
