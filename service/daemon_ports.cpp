// Ports that open and are introduced to their peers; sources that an operator deactivates.
#include <memory>
#include <set>
#include <stdexcept>
#include <utility>

#include "service/clients/given_names.hpp"
#include "service/clients/replies.hpp"
#include "service/daemon.hpp"
#include "service/kept/step.hpp"
#include "service/log/event.hpp"
#include "service/log/log.hpp"
#include "shm/clock.hpp"

namespace arbiter::service {
namespace {

// How long a component waits for a port of its name that yields, and may not do so.
constexpr shm::Nanoseconds kMaxWaitForYield = kMaxWaitForClients;

}  // namespace

Client* Daemon::find_holder(const Client& asking, shm::PortInstance holder) {
  if (holder == 0) return nullptr;
  Client* client = nullptr;
  if (const auto* output = switchboard_.output(holder)) client = output->client;
  if (const auto* input = switchboard_.input(holder)) client = input->client;
  if (client == nullptr || client == &asking) return client;
  // What others sent earlier may come later, for each has a socket of its own.
  client->read_ahead();
  if (client->take_closing_of(holder)) {
    close_port(*client, holder);
    return nullptr;
  }
  if (!client->has_gone()) return client;
  // What it has closed itself did not die with it.
  for (const shm::PortInstance port : std::set(client->ports)) {
    if (client->take_closing_of(port)) close_port(*client, port);
  }
  drop(client->id());  // for one that is only dying yet its names are kept a moment longer
  return nullptr;
}

void Daemon::require_free(const Client& asking, shm::PortInstance holder, const std::string& what) {
  const Client* const client = find_holder(asking, holder);
  if (client != nullptr) throw std::runtime_error(what + " is held by " + client->description());
}

// The port is asked once, however many want its name and however often. The name is promised to
// them, or a holder that closes its port and asks again at once would have it before they do.
void Daemon::require_yielded(const Client& asking, Source& source, bool yields) {
  const std::string what = "the output port " + source.name;
  const shm::Nanoseconds now = shm::monotonic_now();
  Client* const holder = find_holder(asking, source.open);
  if (holder == nullptr) {
    if (!yields || now >= source.promised_until) return;
    throw std::runtime_error(what + " yields to a component that has asked for it");
  }
  const std::string why = what + " is held by " + holder->description();
  const bool may_wait = switchboard_.output(source.open)->yields && !yields && holder != &asking;
  if (!may_wait) throw std::runtime_error(why);
  source.promised_until = now + kMaxWaitForYield;
  switchboard_.ask_to_yield(source.open, asking.description());
  throw NotYet(why, source.promised_until);
}

// Somebody may wait for its name.
void Daemon::remove_port(shm::PortInstance port) {
  const OutputPort* const output = switchboard_.output(port);
  if (output != nullptr && output->is_asked_to_yield) try_postponed_ = true;
  switchboard_.remove(port);
}

void Daemon::open_output(Client& client, wire::Received& received) {
  names_.closed().make_room();
  const std::string name = port_name(received.message);
  gate_.require(client, Action::kOutput, name);
  auto port = adopt_output(received, client.user());
  names_.give_back(shm::monotonic_now());  // what this client may have closed just before
  port->charge = shares_.take(client.user(), Share::kDescriptors, kDescriptorsOfOutput);
  Source& source = names_.source(name, client.user());
  names_.let_go(source);  // if it is not opened after all
  require_yielded(client, source, port->yields);
  takeover_.require_not_kept(client, source.away, "the output port " + name);
  require_not_changing(source);
  if (!source.has_page()) {  // its last publisher has ended, and nobody has handed it back
    names_.replace_lost_page(source);
    introductions_.introduce(switchboard_.link_all(board_.in_force().table), [] {});
  }
  const std::uint64_t request = received.message.request;
  if (PortNames::may_be_given(source, client.user())) {
    finish_opening(client, request, std::move(port), source);
    return;
  }
  const auto kept = std::make_shared<std::unique_ptr<OutputPort>>(std::move(port));
  change_page(source, client, request, client.user(),
              [this, kept, request](Source& own, Client& opener) {
                finish_opening(opener, request, std::move(*kept), own);
              });
}

void Daemon::finish_opening(Client& client, std::uint64_t request, std::unique_ptr<OutputPort> port,
                            Source& source) {
  const auto why_no_replay = gate_.why_not(client, Action::kReplay, source.name);
  takeover_.remember_component(client);
  names_.give_page(source, client.user());
  source.promised_until = 0;
  const OutputPort& opened = switchboard_.add(std::move(port), client, source);
  auto reply = reply_to(request, wire::MessageKind::kOpened);
  reply.port = opened.instance;
  reply.id = source.id;
  if (why_no_replay) {
    reply.set_text(*why_no_replay);
  } else {
    reply.flags = wire::kMayReplay;
  }
  client.send(reply, {source.page.writable.get(), -1});
  refusals_.forget(Refusals::End::kOutput, source.name);
  takeover_.deaths().note_output_opened(source.name);
  at_step("output-open");
  log_event({EventKind::kOpened, {client.name}, {source.name}}, log::level::info,
            "{} opened output port {}", client.description(), source.name);
  connect(client, request, opened.instance);
}

void Daemon::open_input(Client& client, wire::Received& received) {
  names_.closed().make_room();
  const std::string name = port_name(received.message);
  gate_.require(client, Action::kInput, name);
  auto port = adopt_input(received, client.user());
  names_.give_back(shm::monotonic_now());
  port->charge = shares_.take(client.user(), Share::kDescriptors, kDescriptorsOfInput);
  InputName& input = names_.input(name, client.user());
  names_.let_go(input);
  require_free(client, input.open, "the input port " + name);
  takeover_.require_not_kept(client, input.away, "the input port " + name);
  takeover_.remember_component(client);
  const InputPort& opened = switchboard_.add(std::move(port), client, input);
  auto reply = reply_to(received.message.request, wire::MessageKind::kOpened);
  reply.port = opened.instance;
  reply.id = input.id;
  client.send(reply);
  refusals_.forget(Refusals::End::kInput, name);
  takeover_.deaths().note_input_opened(name);
  at_step("input-open");
  log_event({EventKind::kOpened, {client.name}, {}, {name}}, log::level::info,
            "{} opened input port {}", client.description(), name);
  connect(client, received.message.request, opened.instance);
}

void Daemon::close_port(const Client& client, shm::PortInstance port) {
  if (client.ports.count(port) == 0) return;
  if (const OutputPort* const output = switchboard_.output(port)) {
    log_event({EventKind::kClosed, {client.name}, {output->source->name}}, log::level::info,
              "{} closed output port {}", client.description(), output->source->name);
  } else if (const InputPort* const input = switchboard_.input(port)) {
    log_event({EventKind::kClosed, {client.name}, {}, {input->name->name}}, log::level::info,
              "{} closed input port {}", client.description(), input->name->name);
  }
  remove_port(port);
}

// Nor is anything kept that it has asked for and did not wait for.
void Daemon::close_all(Client& client) {
  client.comes_back = false;
  while (!client.ports.empty()) close_port(client, *client.ports.begin());
}

// A tap is told by those whom it taps, before its program is told that it is open.
void Daemon::open_tap(Client& client, wire::Received& received) {
  const std::string name = port_name(received.message);
  gate_.require(client, Action::kTap, name);
  auto tap = adopt_tap(received, client.user());
  tap->name = name;
  tap->is_privileged = shares_.is_privileged(client.user());
  tap->charge = shares_.take(client.user(), Share::kDescriptors, kDescriptorsOfTap);
  const bool is_input = tap->is_input;
  const Tap& opened = *tap;
  const std::uint64_t request = received.message.request;
  auto told = switchboard_.add_tap(std::move(tap), client, board_.in_force().table, [&] {
    auto reply = reply_to(request, wire::MessageKind::kOpened);
    reply.port = opened.instance;
    client.send(reply);
  });
  switchboard_.tell_wrong_end(board_.in_force(), opened);
  log::info("{} taps the {} port {}", client.description(), is_input ? "input" : "output", name);
  introductions_.introduce(told, [this, id = client.id(), request] {
    Client* const opener = clients_.find(id);
    if (opener != nullptr) opener->send(reply_to(request, wire::MessageKind::kConnected));
  });
}

// Introduces a new port to its peers, and tells its component once they know it.
void Daemon::connect(Client& client, std::uint64_t request, shm::PortInstance port) {
  const auto in_force = board_.in_force();
  auto told = switchboard_.link_one(in_force.table, port);
  switchboard_.tell_unmentioned(in_force, port);
  // Hears of it in order, before the kConnected. But its receivers have to wait for an output port.
  if (switchboard_.output(port) == nullptr) told.erase(&client);
  introductions_.introduce(told, [this, id = client.id(), request] {
    at_step("peers-ready");
    Client* const opener = clients_.find(id);
    if (opener != nullptr) opener->send(reply_to(request, wire::MessageKind::kConnected));
  });
}

void Daemon::deactivate(Client& client, const wire::Message& message) {
  const std::string name = port_name(message);
  gate_.require(client, Action::kDeactivate, name);
  Source* source = names_.find_source(name);
  if (source == nullptr) {
    throw std::runtime_error("no model and no component has named the source " + name);
  }
  if (const Client* const holder = find_holder(client, source->open)) {
    throw std::runtime_error("the output port " + name + " is held by " + holder->description() +
                             ", which alone can end its activity: stop it, or let it call "
                             "deactivate()");
  }
  takeover_.require_not_kept(client, source->away, "the output port " + name);
  require_not_changing(*source);
  if (!source->has_page()) throw std::runtime_error("nobody has the activity of " + name);
  const bool was_active = end_activity(*source);
  const auto answer = [this, was_active, request = message.request](Source& ended, Client& asking) {
    end_activity(ended);  // who had it may have written there until it was replaced
    names_.let_go(ended);
    auto reply = reply_to(request, wire::MessageKind::kDone);
    reply.value = was_active ? 1 : 0;
    asking.send(reply);
    log_event({EventKind::kDeactivated, {asking.name}, {ended.name}}, log::level::info,
              "{} deactivated {}{}", asking.description(), ended.name,
              was_active ? "" : ", which was not active");
  };
  if (may_undo(*source)) {  // also where it is inactive for the moment
    change_page(*source, client, message.request, {}, answer);
  } else {
    answer(*source, client);
  }
}

}  // namespace arbiter::service
