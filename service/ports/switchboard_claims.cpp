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
  const auto found = outputs_.find(port);
  const bool is_output = found != outputs_.end();
  for (auto link = first_link(port); link != links_.end();) {
    const auto [output, input] = link->first;
    if (is_output && output != port) break;
    if (output == port && (link->second.is_mutual() || link->second.is_refused())) {
      claim(input, port, {link->second.number});
    }
    if (input == port) claim(output, port, {link->second.number});
    link = output == port || input == port ? links_.erase(link) : std::next(link);
  }
  taps_.set_away(port);
  Source* const source = is_output ? found->second->source : nullptr;
  InputName* const name = is_output ? nullptr : inputs_.at(port)->name;
  Charge charge = std::move(is_output ? found->second->charge : inputs_.at(port)->charge);
  erase(port);
  (is_output ? source->away : name->away) = port;
  return charge;
}

OutputPort& Switchboard::readmit(std::unique_ptr<OutputPort> port, Client& client, Source& source) {
  OutputPort& readmitted = *port;
  port->instance = source.away;
  insert(std::move(port), client, source);
  return readmitted;
}

InputPort& Switchboard::readmit(std::unique_ptr<InputPort> port, Client& client, InputName& name) {
  InputPort& readmitted = *port;
  port->instance = name.away;
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
    links_[{output.instance, input.instance}] = {LinkKind::kConnected, *by_output, ""};
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
  if (by_output) links_[{output.instance, input.instance}] = {LinkKind::kLapsed, 0, ""};
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

void Switchboard::forget_away(shm::PortInstance port) {
  end_claims_on(port);
  taps_.end(port);
  if (Source* source = names_.source_of(port)) {
    source->away = 0;
    names_.let_go(*source);
    registry_.source(source->id).clear_owner();
  } else if (InputName* name = names_.input_of(port)) {
    taps_.end(port, name->name);
    name->away = 0;
    names_.let_go(*name);
    registry_.input(name->id).clear_owner();
  }
}

}  // namespace arbiter::service
