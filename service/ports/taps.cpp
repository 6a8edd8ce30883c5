#include "service/ports/taps.hpp"

#include <algorithm>
#include <utility>

#include "service/ports/foreign_parts.hpp"
#include "shm/event_segment.hpp"
#include "shm/tap_segment.hpp"
#include "wire/errands.hpp"

namespace arbiter::service {

// The last who closes a segment frees its memory, which takes its time.
Tap::~Tap() { wire::Errands::of_the_process().close(user, std::move(segment)); }

std::unique_ptr<Tap> adopt_tap(const wire::Received& open, uid_t user) {
  require_descriptors(open, 2);
  auto tap = std::make_unique<Tap>();
  if (own_segment(open.descriptors[0], user, sizeof(shm::TapSegment)) != sizeof(shm::TapSegment)) {
    throw std::runtime_error("the segment is not a tap's of this version");
  }
  tap->bell = own_bell(open.descriptors[1], user);
  tap->segment = kept(open.descriptors[0]);
  tap->user = user;
  tap->is_input = (open.message.flags & wire::kTapsInput) != 0;
  tap->is_back = (open.message.flags & wire::kRejoins) != 0;
  return tap;
}

Tap& Taps::add(std::unique_ptr<Tap> tap, Client& client) {
  tap->instance = registry_.next_instance();
  tap->client = &client;
  return *(taps_[tap->instance] = std::move(tap));
}

bool Taps::is_of(const Client& client, shm::PortInstance tap) const {
  const auto found = taps_.find(tap);
  return found != taps_.end() && found->second->client == &client;
}

void Taps::remove(shm::PortInstance tap, const Outputs& outputs, const Inputs& inputs) {
  std::erase_if(links_, [&](const auto& each) {
    const auto& [key, link] = each;
    if (key.second != tap) return false;
    const auto output = outputs.find(key.first);
    if (output != outputs.end()) {
      output->second->client->send(message_to(wire::MessageKind::kPeerGone, key.first, tap));
    }
    return true;
  });
  const auto found = taps_.find(tap);
  if (found == taps_.end()) return;
  const std::string name = found->second->is_input ? found->second->name : "";
  taps_.erase(found);
  const bool is_tapped = std::any_of(taps_.begin(), taps_.end(), [&](const auto& other) {
    return other.second->is_input && other.second->name == name;
  });
  if (name.empty() || is_tapped) return;
  for (const auto& [instance, input] : inputs) {
    if (input->name->name == name) measure(*input, false);
  }
}

void Taps::lose(const Client& client, bool lives, const Outputs& outputs, const Inputs& inputs) {
  for (auto tap = taps_.begin(); tap != taps_.end();) {
    const auto next = std::next(tap);
    if (tap->second->client == &client) {
      for (const auto& [key, link] : links_) {
        const auto output = outputs.find(key.first);
        if (!lives || key.second != tap->first || output == outputs.end()) continue;
        output->second->client->send(
            message_to(wire::MessageKind::kTapAway, key.first, key.second));
      }
      if (lives) std::erase_if(links_, [&](const auto& l) { return l.first.second == tap->first; });
      remove(tap->first, outputs, inputs);
    }
    tap = next;
  }
}

bool Taps::wants(const Tap& tap, const OutputPort& output, const shm::TableView& table) const {
  if (!tap.is_input) return output.source->name == tap.name;
  const auto connections = table.connections_of_source(output.source->id);
  for (shm::Word i = 0; i < connections.count; ++i) {
    const InputName* const input = names_.input_by_id(table.rule(connections[i]).port);
    if (input != nullptr && input->name == tap.name) return true;
  }
  return false;
}

bool Taps::ask(const Tap& tap, const OutputPort& output) {
  const auto [link, is_new] = links_.try_emplace({output.instance, tap.instance});
  if (!is_new && !link->second.is_away) return false;
  link->second.is_away = false;
  link->second.is_asked = true;
  auto message = message_to(wire::MessageKind::kTap, output.instance, tap.instance);
  message.value = tap.is_privileged ? 0 : tap.user;
  message.flags = tap.is_privileged ? wire::kIsPrivileged : 0u;
  output.client->send(message, {tap.segment.get(), tap.bell->descriptor()});
  return true;
}

void Taps::unlink(const shm::TableView& table, const Outputs& outputs) {
  std::erase_if(links_, [&](const auto& each) {
    const auto& [key, link] = each;
    const auto output = outputs.find(key.first);
    const Tap& tap = *taps_.at(key.second);
    if (output == outputs.end() || wants(tap, *output->second, table)) return false;
    if (link.is_told) {
      tap.client->send(message_to(wire::MessageKind::kDisconnected, key.second, key.first));
    }
    // Which heeds what the tap holds for as long as that lives.
    output->second->client->send(
        message_to(wire::MessageKind::kDisconnected, key.first, key.second));
    return true;
  });
}

bool Taps::tell(const OutputPort& output, const wire::Received& answer) {
  const auto link = links_.find({output.instance, answer.message.peer});
  if (link == links_.end() || !std::exchange(link->second.is_asked, false)) return false;
  require_descriptors(answer, 1);
  if (own_segment(answer.descriptors[0], output.user, sizeof(shm::EventSegment)) !=
      sizeof(shm::EventSegment)) {
    throw std::runtime_error("the segment is not one of events of this version");
  }
  const Tap& tap = *taps_.at(answer.message.peer);
  auto message =
      message_to(wire::MessageKind::kTapSource, tap.instance, output.instance, output.source->id);
  message.link = answer.message.link;
  message.value = answer.message.value;
  message.set_name(output.source->name);
  link->second.is_told = true;
  tap.client->send(message, {output.segment.get(), answer.descriptors[0].get()});
  return true;
}

void Taps::refuse(const OutputPort& output, shm::PortInstance tap, const std::string& why) {
  const auto link = links_.find({output.instance, tap});
  if (link == links_.end() || !std::exchange(link->second.is_asked, false)) return;
  auto message =
      message_to(wire::MessageKind::kConnectionRefused, tap, output.instance, output.source->id);
  message.set_name(output.source->name);
  message.set_text(why);
  taps_.at(tap)->client->send(message);
}

void Taps::set_away(shm::PortInstance output) {
  for (auto& [key, link] : links_) {
    if (key.first == output) link.is_away = true;
  }
}

// Its page may be another by now, where nobody had the last one: so nothing is said of its
// activity.
void Taps::tell_end(const Tap& tap, const Source& source) {
  if (source.open != 0) return;
  if (source.away != 0) {
    links_[{source.away, tap.instance}] = {.is_told = true, .is_away = true};
    return;
  }
  tap.client->send(message_to(wire::MessageKind::kPeerGone, tap.instance, 0, source.id));
}

void Taps::tell_ends(const Tap& tap, const shm::TableView& table) {
  if (!tap.is_back) return;
  if (!tap.is_input) {
    if (const Source* const source = names_.find_source(tap.name)) tell_end(tap, *source);
    return;
  }
  for (const auto& input : names_.inputs()) {
    if (input->name != tap.name) continue;
    const auto range = table.connections_to(input->id);
    for (auto index = range.first; index != range.first + range.count; ++index) {
      const Source* const source = names_.source_by_id(table.rule(index).source);
      if (source != nullptr) tell_end(tap, *source);
    }
  }
}

// Nobody writes the activity any more: what the publisher may have stamped and not told of, the
// page has.
void Taps::end(shm::PortInstance output) {
  if (links_.lower_bound({output, 0}) == links_.lower_bound({output + 1, 0})) return;
  auto message = message_to(wire::MessageKind::kPeerGone, 0, output);
  const Source* const source = names_.source_of(output);
  if (source != nullptr && source->has_page()) {
    message.flags = wire::kTellsActivity;
    message.link =
        static_cast<std::uint64_t>(source->activity().word.load(std::memory_order_relaxed));
  }
  std::erase_if(links_, [&](const auto& each) {
    const auto& [key, link] = each;
    if (key.first != output) return false;
    if (link.is_told) {
      const Tap& tap = *taps_.at(key.second);
      message.port = tap.instance;
      tap.client->send(message);
      tap.bell->ring();  // it may have died between telling and ringing
    }
    return true;
  });
}

void Taps::show(const Tap& tap, const InputPort& input) const {
  if (!tap.is_input || tap.name != input.name->name) return;
  auto message = message_to(wire::MessageKind::kTapInput, tap.instance, input.instance);
  message.set_name(tap.name);
  tap.client->send(message, {input.segment.get(), -1});
  measure(input, true);
}

void Taps::measure(const InputPort& input, bool is_tapped) {
  auto message = message_to(wire::MessageKind::kMeasure, input.instance, 0);
  message.value = is_tapped ? 1 : 0;
  input.client->send(message);
}

void Taps::show(const InputPort& input) const {
  for (const auto& [instance, tap] : taps_) show(*tap, input);
}

void Taps::end(shm::PortInstance input, const std::string& name) const {
  for (const auto& [instance, tap] : taps_) {
    if (!tap->is_input || tap->name != name) continue;
    tap->client->send(message_to(wire::MessageKind::kPeerGone, instance, input));
  }
}

std::vector<const Tap*> Taps::of(shm::PortInstance output) const {
  std::vector<const Tap*> found;
  for (const auto& [key, link] : links_) {
    if (key.first == output && link.is_told) found.push_back(taps_.at(key.second).get());
  }
  return found;
}

}  // namespace arbiter::service
