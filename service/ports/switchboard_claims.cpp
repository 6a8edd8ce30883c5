// The links of components that are lost to the daemon for a while, or to its predecessor for good.
//
// A link lives in shared memory, not here: two components go on using it though no daemon knows of
// it. So when one end comes back it claims the links that it has. Once both ends are here, a link
// that they agree upon stands as it is; where only one of them has heard of it, it is ended. An end
// is here once it has said all (kHandedBack): nothing is concluded before from what it has not
// claimed.
#include <optional>
#include <utility>

#include "service/ports/switchboard.hpp"
#include "shm/bell.hpp"

namespace arbiter::service {

Charge Switchboard::set_away(shm::PortInstance port) {
  for (const LinkKey& key : links_of(port)) {
    const auto [output, input] = key;
    const Link link = take_link(key);
    const bool is_heard_of = link.is_mutual() || link.is_refused();
    if (output == port && is_heard_of) claim(input, port, {link.number});
    if (input == port) claim(output, port, {link.number});
  }
  taps_.set_away(port);
  const auto output = outputs_.find(port);
  if (output != outputs_.end()) {
    Charge charge = std::move(output->second->charge);
    Source& source = *output->second->source;
    erase(port);
    source.away = port;
    return charge;
  }
  InputPort& input = *inputs_.at(port);
  Charge charge = std::move(input.charge);
  InputName& name = *input.name;
  erase(port);
  name.away = port;
  return charge;
}

OutputPort& Switchboard::readmit(std::unique_ptr<OutputPort> port, Client& client, Source& source) {
  OutputPort& readmitted = *port;
  port->instance = source.away;
  port->has_returned = true;
  insert(std::move(port), client, source);
  return readmitted;
}

InputPort& Switchboard::readmit(std::unique_ptr<InputPort> port, Client& client, InputName& name) {
  InputPort& readmitted = *port;
  port->instance = name.away;
  port->has_returned = true;
  insert(std::move(port), client, name);
  return readmitted;
}

Claims& Switchboard::claims_of(shm::PortInstance port) const {
  const auto output = outputs_.find(port);
  return output != outputs_.end() ? output->second->claims : inputs_.at(port)->claims;
}

void Switchboard::claim(shm::PortInstance port, shm::PortInstance peer, Claim claim) {
  claims_of(port)[peer] = std::move(claim);
  claimed_.emplace(peer, port);
}

// Takes a claim out: its number, 0 where it is not one of a connection, nothing where there is
// none.
std::optional<std::uint64_t> Switchboard::take_claim(shm::PortInstance port,
                                                     shm::PortInstance peer) {
  if (claimed_.erase({peer, port}) == 0) return {};
  Claims& claims = claims_of(port);
  const auto found = claims.find(peer);
  const std::uint64_t number = found->second.number;
  claims.erase(found);
  return number;
}

void Switchboard::settle_claims(shm::PortInstance port,
                                const std::function<bool(shm::PortInstance)>& is_away) {
  const bool is_output = outputs_.count(port) != 0;
  // Those of peers that are here count too: this end may not have heard of the link.
  std::set<shm::PortInstance> peers;
  for (const auto& [peer, claim] : claims_of(port)) peers.insert(peer);
  for (auto each = claimed_.lower_bound({port, 0}); each != claimed_.end() && each->first == port;
       ++each) {
    if (outputs_.contains(each->second) != is_output) peers.insert(each->second);
  }
  for (const shm::PortInstance peer : peers) {
    const auto output = outputs_.find(is_output ? port : peer);
    const auto input = inputs_.find(is_output ? peer : port);
    if (output != outputs_.end() && input != inputs_.end()) {
      if (!client_of(peer).is_returning) settle(*output->second, *input->second);
    } else if (!is_away(peer)) {
      take_claim(port, peer);
      client_of(port).send(message_to(wire::MessageKind::kPeerGone, port, peer));
    }
  }
}

void Switchboard::settle(OutputPort& output, InputPort& input) {
  const auto by_output = take_claim(output.instance, input.instance);
  const auto by_input = take_claim(input.instance, output.instance);
  if (by_output && by_input && *by_output == *by_input && *by_output != 0) {
    link_at({output.instance, input.instance}) = {LinkKind::kConnected, *by_output, ""};
    return;
  }
  if (by_output.value_or(0) != 0) {
    output.client->send(
        message_to(wire::MessageKind::kDisconnected, output.instance, input.instance));
  }
  if (by_input.value_or(0) != 0) {
    input.client->send(
        message_to(wire::MessageKind::kDisconnected, input.instance, output.instance));
  }
  // The publisher knows the port, and heeds what it holds.
  if (by_output) link_at({output.instance, input.instance}) = {LinkKind::kLapsed, 0, ""};
}

void Switchboard::end_claims_on(shm::PortInstance port) {
  for (auto each = claimed_.lower_bound({port, 0}); each != claimed_.end() && each->first == port;
       each = claimed_.lower_bound({port, 0})) {
    const shm::PortInstance peer = each->second;
    take_claim(peer, port);
    client_of(peer).send(message_to(wire::MessageKind::kPeerGone, peer, port));
    const auto input = inputs_.find(peer);
    // It may have died between delivering and ringing.
    if (input != inputs_.end()) input->second->bell->ring();
  }
}

void Switchboard::forget_away(const KeptPorts& ports) {
  if (ports.empty()) return;
  for (const auto& source : names_.sources()) {
    if (source->away == 0 || !ports.contains(source->away)) continue;
    end_claims_on(source->away);
    taps_.end(source->away);
    source->away = 0;
    names_.let_go(*source);
    registry_.source(source->id).clear_owner();
  }
  for (const auto& name : names_.inputs()) {
    if (name->away == 0 || !ports.contains(name->away)) continue;
    end_claims_on(name->away);
    taps_.end(name->away, name->name);
    name->away = 0;
    names_.let_go(*name);
    registry_.input(name->id).clear_owner();
  }
}

}  // namespace arbiter::service
