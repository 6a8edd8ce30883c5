#include "service/ports/switchboard.hpp"

#include "service/kept/step.hpp"
#include "service/log/event.hpp"
#include "service/log/log.hpp"
#include "shm/assertion.hpp"

namespace arbiter::service {
namespace {

Owner owner(const Client& client, shm::PortInstance port) {
  return {port, client.node, client.identity()};
}

}  // namespace

OutputPort& Switchboard::add(std::unique_ptr<OutputPort> port, Client& client, Source& source) {
  port->instance = registry_.next_instance();
  OutputPort& added = *port;
  insert(std::move(port), client, source);
  registry_.source(source.id).set_owner(owner(client, added.instance));
  at_step("output-owner-registered");
  return added;
}

InputPort& Switchboard::add(std::unique_ptr<InputPort> port, Client& client, InputName& name) {
  port->instance = registry_.next_instance();
  InputPort& added = *port;
  insert(std::move(port), client, name);
  registry_.input(name.id).set_owner(owner(client, added.instance));
  at_step("input-owner-registered");
  return added;
}

void Switchboard::insert(std::unique_ptr<OutputPort> port, Client& client, Source& source) {
  port->client = &client;
  port->source = &source;
  ARBITER_ASSERT(source.open == 0, "a source would have two writers");
  source.open = port->instance;
  source.away = 0;
  client.ports.insert(port->instance);
  outputs_[port->instance] = std::move(port);
}

void Switchboard::insert(std::unique_ptr<InputPort> port, Client& client, InputName& name) {
  port->client = &client;
  port->name = &name;
  ARBITER_ASSERT(name.open == 0, "an input port would have two owners");
  name.open = port->instance;
  name.away = 0;
  client.ports.insert(port->instance);
  taps_.show(*port);
  inputs_[port->instance] = std::move(port);
}

void Switchboard::remove(shm::PortInstance port) {
  for (const LinkKey& key : links_of(port)) {
    const auto [output, input] = key;
    const Link link = take_link(key);
    const shm::PortInstance peer = output == port ? input : output;
    if (input == port || link.is_mutual() || link.is_refused()) {
      client_of(peer).send(message_to(wire::MessageKind::kPeerGone, peer, port));
    }
    // A publisher may have died between delivering and ringing.
    if (output == port) inputs_.at(peer)->bell->ring();
  }
  end_claims_on(port);
  taps_.end(port);
  at_step("peers-told-of-the-end");
  if (const auto found = outputs_.find(port); found != outputs_.end()) {
    registry_.source(found->second->source->id).clear_owner();
    at_step("output-owner-cleared");
  }
  if (const auto found = inputs_.find(port); found != inputs_.end()) {
    taps_.end(port, found->second->name->name);
    registry_.input(found->second->name->id).clear_owner();
    at_step("input-owner-cleared");
  }
  erase(port);
}

std::vector<Switchboard::LinkKey> Switchboard::links_of(shm::PortInstance port) const {
  std::vector<LinkKey> keys;
  for (auto link = links_.lower_bound({port, 0}); link != links_.end() && link->first.first == port;
       ++link) {
    keys.push_back(link->first);
  }
  for (auto end = linked_.lower_bound({port, 0}); end != linked_.end() && end->first == port;
       ++end) {
    keys.emplace_back(end->second, port);
  }
  return keys;
}

Link& Switchboard::link_at(const LinkKey& key) {
  linked_.emplace(key.second, key.first);
  return links_[key];
}

Link Switchboard::take_link(const LinkKey& key) {
  linked_.erase({key.second, key.first});
  return std::move(links_.extract(key).mapped());
}

void Switchboard::erase(shm::PortInstance port) {
  ARBITER_ASSERT(outputs_.count(port) + inputs_.count(port) == 1, "a port is closed twice");
  ARBITER_ASSERT(links_of(port).empty(), "a port has links when it is closed");
  for (const auto& [peer, claim] : claims_of(port)) claimed_.erase({peer, port});
  if (const auto found = outputs_.find(port); found != outputs_.end()) {
    ARBITER_ASSERT(found->second->source->open == port,
                   "a port is closed that is not its source's");
    found->second->source->open = 0;
    names_.let_go(*found->second->source);
    found->second->client->ports.erase(port);
    found->second->charge = {};
    names_.closed().add(std::move(found->second));
    outputs_.erase(found);
  }
  if (const auto found = inputs_.find(port); found != inputs_.end()) {
    ARBITER_ASSERT(found->second->name->open == port, "a port is closed that is not its name's");
    found->second->name->open = 0;
    names_.let_go(*found->second->name);
    found->second->client->ports.erase(port);
    found->second->charge = {};
    names_.closed().add(std::move(found->second));
    inputs_.erase(found);
  }
}

void Switchboard::want_links(const OutputPort& output, const shm::TableView& table,
                             Wanted& wanted) const {
  const auto want = [&](shm::PortId id, LinkKind kind) {
    const InputName* name = names_.input_by_id(id);
    if (name != nullptr && name->open != 0) wanted[{output.instance, name->open}] = kind;
  };
  const auto concerned = table.ports_concerned(output.source->id);
  for (shm::Word i = 0; i < concerned.count; ++i) want(concerned[i], LinkKind::kSensing);
  const auto connections = table.connections_of_source(output.source->id);
  for (shm::Word i = 0; i < connections.count; ++i) {
    want(table.rule(connections[i]).port, LinkKind::kConnected);
  }
}

void Switchboard::want_links(const InputPort& input, const shm::TableView& table,
                             Wanted& wanted) const {
  const auto want = [&](shm::SourceId id, LinkKind kind) {
    const Source* source = names_.source_by_id(id);
    if (source != nullptr && source->open != 0) wanted[{source->open, input.instance}] = kind;
  };
  const auto read = table.sources_read(input.name->id);
  for (shm::Word i = 0; i < read.count; ++i) want(read[i], LinkKind::kSensing);
  const auto range = table.connections_to(input.name->id);
  for (auto index = range.first; index != range.first + range.count; ++index) {
    want(table.rule(index).source, LinkKind::kConnected);
  }
}

Switchboard::Told Switchboard::link_all(const shm::TableView& table) {
  Told told;
  Wanted wanted;
  for (const auto& [instance, input] : inputs_) {
    send_pages(*input->client, input->name->id, table, told);
  }
  for (const auto& [instance, output] : outputs_) {
    send_pages(*output, table, told);
    want_links(*output, table, wanted);
  }
  make_links(wanted, told);
  taps_.link(table, outputs_, [&](Client* client) { told.insert(client); });
  return told;
}

Switchboard::Told Switchboard::link_one(const shm::TableView& table, shm::PortInstance port) {
  Told told;
  Wanted wanted;
  bool has_returned = false;
  if (const auto input = inputs_.find(port); input != inputs_.end()) {
    has_returned = std::exchange(input->second->has_returned, false);
    send_pages(*input->second->client, input->second->name->id, table, told);
    want_links(*input->second, table, wanted);
  }
  if (const auto output = outputs_.find(port); output != outputs_.end()) {
    has_returned = std::exchange(output->second->has_returned, false);
    send_pages(*output->second, table, told);
    want_links(*output->second, table, wanted);
    taps_.link(table, *output->second, [&](Client* client) { told.insert(client); });
  }
  make_links(wanted, told);
  if (has_returned) {
    for (const LinkKey& key : links_of(port)) {
      if (!is_connected(key)) continue;
      told.insert({&client_of(key.first), &client_of(key.second)});
      fresh_.push_back(key);
    }
  }
  return told;
}

Switchboard::Told Switchboard::add_tap(std::unique_ptr<Tap> tap, Client& client,
                                       const shm::TableView& table,
                                       const std::function<void()>& opened) {
  Told told;
  const Tap& added = taps_.add(std::move(tap), client);
  opened();
  for (const auto& [instance, input] : inputs_) taps_.show(added, *input);
  taps_.tell_ends(added, table);
  taps_.link(table, outputs_, [&](Client* publisher) { told.insert(publisher); });
  return told;
}

void Switchboard::tell_tap(const wire::Received& answer) {
  const auto output = outputs_.find(answer.message.port);
  // The publisher uses more of its segment from now on.
  if (output != outputs_.end() && taps_.tell(*output->second, answer)) note_growth(output->first);
}

void Switchboard::note_growth(shm::PortInstance output) {
  for (auto link = links_.lower_bound({output, 0});
       link != links_.end() && link->first.first == output; ++link) {
    growth_.insert(link->first);
  }
}

void Switchboard::make_links(const Wanted& wanted, Told& told) {
  for (const auto& [key, kind] : wanted) {
    // It may have such a link, and be about to say so.
    if (client_of(key.first).is_returning || client_of(key.second).is_returning) continue;
    const auto known = links_.find(key);
    const bool stands = known != links_.end() && known->second.kind != LinkKind::kLapsed &&
                        (known->second.kind == kind || kind == LinkKind::kSensing);
    if (!stands) make_link(*outputs_.at(key.first), *inputs_.at(key.second), kind, told);
  }
}

// A mismatch leaves the two linked as if the input port only sensed the source, and both are told.
void Switchboard::make_link(const OutputPort& output, const InputPort& input, LinkKind kind,
                            Told& told) {
  Link& link = link_at({output.instance, input.instance});
  link.kind = kind;
  link.mismatch =
      kind == LinkKind::kConnected
          ? shm::type_mismatch(output.type, input.type, output.client->name, input.client->name)
          : "";
  const bool connects = kind == LinkKind::kConnected && link.mismatch.empty();
  if (!link.mismatch.empty()) {
    log_event({EventKind::kMismatch,
               {output.client->name, input.client->name},
               {output.source->name},
               {input.name->name}},
              log::level::warn, "{} is not connected to {}: {}", output.source->name,
              input.name->name, link.mismatch);
  } else if (connects) {
    log::debug("{} is connected to {}", output.source->name, input.name->name);
  }
  auto to_output =
      message_to(wire::MessageKind::kInputPeer, output.instance, input.instance, input.name->id);
  to_output.flags = connects ? wire::kIsConnected : 0u;
  to_output.link = link.number = connects ? registry_.next_link() : 0;
  to_output.set_name(input.name->name);
  output.client->send(to_output, {input.segment.get(), input.bell->descriptor()});
  at_step("publisher-introduced");
  told.insert(output.client);
  if (link.is_refused()) {
    tell_refusal({output.instance, input.instance}, output.instance, link.mismatch);
    tell_refusal({output.instance, input.instance}, input.instance, link.mismatch);
    told.insert(input.client);
  }
  if (!connects) return;
  auto to_input = message_to(wire::MessageKind::kOutputPeer, input.instance, output.instance,
                             output.source->id);
  to_input.link = link.number;
  to_input.set_name(output.source->name);
  input.client->send(to_input, {output.segment.get(), -1});
  at_step("receiver-introduced");
  told.insert(input.client);
  fresh_.emplace_back(output.instance, input.instance);
}

Switchboard::Told Switchboard::show_segments(const std::vector<LinkKey>& fresh) {
  Told told;
  for (const LinkKey& key : fresh) {
    if (!is_connected(key)) continue;
    Client& receiver = client_of(key.second);
    receiver.send(message_to(wire::MessageKind::kOutputGrown, key.second, key.first));
    told.insert(&receiver);
    note_growth(key.first);
    growth_.erase(key);
  }
  return told;
}

// It is worth a page fault to them, and no more: one that does not read is passed over, for its
// queue must not fill up with this.
void Switchboard::show_growth() {
  constexpr int kMostAtOnce = 512;
  std::map<const Client*, int> room;
  for (auto each = growth_.begin(); each != growth_.end();) {
    if (!is_connected(*each)) {
      each = growth_.erase(each);
      continue;
    }
    Client& receiver = client_of(each->second);
    int& left = room.try_emplace(&receiver, receiver.has_queue() ? -1 : kMostAtOnce).first->second;
    if (left == 0) {
      ++each;
      continue;
    }
    if (left > 0) {
      receiver.send(message_to(wire::MessageKind::kOutputGrown, each->second, each->first));
      --left;
    }
    each = growth_.erase(each);
  }
}

bool Switchboard::is_connected(const LinkKey& key) const {
  const auto link = links_.find(key);
  return link != links_.end() && link->second.is_mutual();
}

Switchboard::Told Switchboard::unlink(const shm::TableView& table) {
  Told told;
  taps_.unlink(table, outputs_);
  Wanted wanted;
  for (const auto& [instance, output] : outputs_) want_links(*output, table, wanted);
  for (auto& [key, link] : links_) {
    const auto still = wanted.find(key);
    const LinkKind kind = still == wanted.end() ? LinkKind::kLapsed : still->second;
    if (kind == link.kind) continue;
    if (link.is_mutual() || link.is_refused()) {
      const OutputPort& output = *outputs_.at(key.first);
      const InputPort& input = *inputs_.at(key.second);
      output.client->send(message_to(wire::MessageKind::kDisconnected, key.first, key.second));
      at_step("publisher-disconnected");
      input.client->send(message_to(wire::MessageKind::kDisconnected, key.second, key.first));
      at_step("receiver-disconnected");
      told.insert(output.client);
      told.insert(input.client);
    }
    link = {kind, 0, ""};
  }
  return told;
}

Client& Switchboard::client_of(shm::PortInstance port) const {
  const auto output = outputs_.find(port);
  return output != outputs_.end() ? *output->second->client : *inputs_.at(port)->client;
}

void Switchboard::ring_all() const {
  for (const auto& [instance, input] : inputs_) input->bell->ring();
}

void Switchboard::ring_concerned(const shm::TableView& table, shm::SourceId source) const {
  const auto ring = [&](shm::PortId id) {
    const InputName* name = names_.input_by_id(id);
    if (name != nullptr && name->open != 0) inputs_.at(name->open)->bell->ring();
  };
  const auto concerned = table.ports_concerned(source);
  for (shm::Word i = 0; i < concerned.count; ++i) ring(concerned[i]);
  const auto connections = table.connections_of_source(source);
  for (shm::Word i = 0; i < connections.count; ++i) ring(table.rule(connections[i]).port);
}

const OutputPort* Switchboard::output(shm::PortInstance instance) const {
  const auto found = outputs_.find(instance);
  return found == outputs_.end() ? nullptr : found->second.get();
}

const InputPort* Switchboard::input(shm::PortInstance instance) const {
  const auto found = inputs_.find(instance);
  return found == inputs_.end() ? nullptr : found->second.get();
}

}  // namespace arbiter::service
