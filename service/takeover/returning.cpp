// Components that come back, each with what it had; those that are away; those that cannot be taken
// back.
#include <algorithm>
#include <stdexcept>
#include <utility>

#include "service/clients/given_names.hpp"
#include "service/clients/replies.hpp"
#include "service/kept/step.hpp"
#include "service/log/event.hpp"
#include "service/log/log.hpp"
#include "service/log/log_sink.hpp"
#include "service/takeover/takeover.hpp"
#include "shm/clock.hpp"

namespace arbiter::service {
namespace {

// About what it takes to remember one link that a component says it has.
constexpr std::uint64_t kBytesOfAClaim = 128;

// How long a name is asked for in vain that a component has whose conversation is lost: it may be
// dying.
constexpr shm::Nanoseconds kMaxWaitForDeath = 100'000'000;

}  // namespace

bool Takeover::knows(const shm::FileDescriptor& board) const {
  if (!board) return false;
  const auto known =
      phase_ == Phase::kExpecting ? predecessor_->realm.board : shm::identity_of(board_.readable());
  return shm::identity_of(board) == known;
}

void Takeover::rejoin(Client& client, const wire::Received& hello) {
  try {
    take_back(client, hello);
  } catch (const std::exception& error) {
    client.is_turned_away = true;
    const std::string why = error.what();
    if (!strangers_.refuse(client, hello.message.link, why, shm::monotonic_now())) {
      throw RefusedAgain(why);
    }
    throw;
  }
}

void Takeover::take_back(Client& client, const wire::Received& hello) {
  if (phase_ == Phase::kExpecting) {
    if (!(Realm{shm::identity_of(hello.descriptors[0]), shm::identity_of(hello.descriptors[1])} ==
          predecessor_->realm)) {
      throw std::runtime_error("this daemon's predecessor had other memory");
    }
    inherit(hello.descriptors[0], hello.descriptors[1]);
    store_realm();
  } else if (!(shm::identity_of(hello.descriptors[0]) == shm::identity_of(board_.readable()))) {
    throw std::runtime_error("this daemon does not know the ports of \"" + client.name +
                             "\", which another daemon has opened; restart the component");
  }
  const NodeId node = hello.message.link;
  end_conversation_of(client, node);
  const auto absentee = absentees_.find(node);
  if (absentee != absentees_.end() && is_that(client, absentee->second)) {
    client.node = node;
    client.to_hand_back = std::move(absentee->second.ports);
    client.why_not_returned = std::move(absentee->second.why_not_returned);
    absentees_.erase(absentee);
  }
  client.is_returning = true;
  client.is_component = true;
  at_step("node-known-again");
  host_.welcome(client);
}

Client* Takeover::former_client(const Client& client, NodeId node) {
  const auto former = std::find_if(clients_.begin(), clients_.end(), [&](const auto& each) {
    return each.second->node == node && each.second.get() != &client &&
           each.second->user() == client.user() &&
           client.is_process(each.second->pid(), each.second->process());
  });
  return former == clients_.end() ? nullptr : former->second.get();
}

// The conversation that it gave up may not have been seen to end.
void Takeover::end_conversation_of(const Client& client, NodeId node) {
  if (const Client* const former = former_client(client, node)) host_.drop(former->id());
}

// A process goes on by its number when it executes a program that runs as another user; who it was
// may have kept a socket from before.
bool Takeover::is_that(const Client& client, const Absentee& absentee) {
  return (!absentee.user || client.user() == *absentee.user) &&
         client.is_process(absentee.pid, absentee.process.get());
}

void Takeover::take_back_page(Client& client, const wire::Received& received) {
  const shm::SourceId id = received.message.id;
  const Source* source = names_.source_by_id(id);
  const std::uint32_t number = received.message.value;
  // Its name is nobody's any more; or it was to come into force next when the last daemon ended.
  const bool is_known = source != nullptr && !source->name.empty();
  if (number != 0 && (!is_known || number == source->page_number + 1)) return;
  if (!names_.take_page(id, received.descriptors[0])) {
    throw std::runtime_error("what was handed back is not the page of source " +
                             std::to_string(id));
  }
  client.pages[id] = names_.source_by_id(id)->page_number;
}

void Takeover::take_back_output(Client& client, const wire::Received& received) {
  const wire::Message& message = received.message;
  Source* source = names_.source_by_id(message.id);
  const auto kept = client.to_hand_back.find(message.port);
  if (source == nullptr || source->away != message.port || kept == client.to_hand_back.end()) {
    throw std::runtime_error("an output port that it never had was handed back");
  }
  // Without the page that is in force nobody would know of its activity.
  if (!names_.take_page(message.id, received.descriptors[1])) {
    throw std::runtime_error("an output port was handed back with a page that is not its own");
  }
  auto port = adopt_output(received, client.user());
  charge(client.user(), *source);
  port->charge = charge_of_port(client.user(), std::move(kept->second), kDescriptorsOfOutput);
  client.to_hand_back.erase(kept);
  switchboard_.readmit(std::move(port), client, *source);
  at_step("output-readmitted");
}

void Takeover::take_back_input(Client& client, const wire::Received& received) {
  const wire::Message& message = received.message;
  InputName* input = names_.input_by_id(message.id);
  const auto kept = client.to_hand_back.find(message.port);
  if (input == nullptr || input->away != message.port || kept == client.to_hand_back.end()) {
    throw std::runtime_error("an input port that it never had was handed back");
  }
  auto port = adopt_input(received, client.user());
  charge(client.user(), *input);
  port->charge = charge_of_port(client.user(), std::move(kept->second), kDescriptorsOfInput);
  client.to_hand_back.erase(kept);
  switchboard_.readmit(std::move(port), client, *input);
  at_step("input-readmitted");
}

void Takeover::take_back_link(const Client& client, const wire::Message& message) {
  if (!client.is_returning || client.ports.count(message.port) == 0) return;
  // It may claim links with ports that have never been, one after the other.
  Charge charge = shares_.take(client.user(), Share::kQueue, kBytesOfAClaim);
  switchboard_.claim(message.port, message.peer, {message.link, std::move(charge)});
}

// A port that it has, and will go on to have: its name must not become another's.
bool Takeover::note_refusal(Client& client, const wire::Message& message, const std::string& why,
                            bool is_ours) {
  const bool is_port = message.kind == wire::MessageKind::kHandBackOutput ||
                       message.kind == wire::MessageKind::kHandBackInput;
  if (is_ours && is_port && client.to_hand_back.contains(message.port)) {
    client.has_failed_to_return = true;
  }
  if (!is_ours || !client.is_returning) return true;
  return std::exchange(client.why_not_returned, why) != why;
}

void Takeover::finish_return(Client& client) {
  if (!client.is_returning) return;
  if (client.has_failed_to_return) {  // it comes again
    host_.drop(client.id());
    return;
  }
  client.is_returning = false;
  client.why_not_returned.clear();
  switchboard_.forget_away(std::exchange(client.to_hand_back, {}));  // closed meanwhile
  std::set<shm::PortInstance> away;
  for (const auto& source : names_.sources()) away.insert(source->away);
  for (const auto& input : names_.inputs()) away.insert(input->away);
  away.erase(0);
  const auto is_away = [&](shm::PortInstance port) { return away.contains(port); };
  for (const shm::PortInstance port : client.ports) switchboard_.settle_claims(port, is_away);
  at_step("claims-settled");
  const auto table = board_.in_force().table;
  switchboard_.link_all(table);
  if (!host_.has_links_ahead()) switchboard_.unlink(table);
  host_.try_postponed();
  log_event({EventKind::kBack, {client.name}}, log::level::info, "{} is back, with {} port{}",
            client.description(), client.ports.size(), client.ports.size() == 1 ? "" : "s");
}

void Takeover::set_away(Client& client) {
  if (client.ports.empty() && client.to_hand_back.empty()) return;
  Absentee& absentee = absentees_[client.node];
  absentee.name = client.name;
  absentee.pid = client.pid();
  absentee.user = client.user();
  absentee.ports = std::exchange(client.to_hand_back, {});
  while (!client.ports.empty()) {
    const shm::PortInstance port = *client.ports.begin();
    absentee.ports[port] = switchboard_.set_away(port);
  }
  absentee.process = client.release_process();
  absentee.why_not_returned = std::move(client.why_not_returned);
  absentee.charge = std::move(client.charge);
  host_.watch_absentee(absentee.process, client.node);
}

void Takeover::log_end_of(const Absentee& absentee) {
  std::optional<LogAccount> account;
  if (absentee.user) account.emplace(*absentee.user);
  Event event{EventKind::kDied};
  if (!absentee.name.empty()) event.components = {absentee.name};
  for (const auto& source : names_.sources()) {
    if (absentee.ports.contains(source->away)) event.sources.push_back(source->name);
  }
  for (const auto& input : names_.inputs()) {
    if (absentee.ports.contains(input->away)) event.ports.push_back(input->name);
  }
  deaths_.note(event, absentee.pid, absentee.user.value_or(0));
  const std::string pid = std::to_string(absentee.pid);
  log_event(
      event, log::level::warn, "{} died with {} open",
      absentee.name.empty() ? "process " + pid : "node \"" + absentee.name + "\" (pid " + pid + ")",
      ports_text(event));
}

void Takeover::forget_absentee(NodeId node) {
  const auto found = absentees_.find(node);
  if (found == absentees_.end()) return;
  log_end_of(found->second);
  give_up(node);
}

void Takeover::give_up(NodeId node) {
  const Absentee absentee = std::move(absentees_.at(node));
  absentees_.erase(node);
  switchboard_.forget_away(absentee.ports);
  if (is_over()) replace_lost_pages();
  host_.try_postponed();
}

void Takeover::forget_ended(const Client& client, NodeId ended) {
  // What it said itself may not have been read yet.
  if (Client* const former = former_client(client, ended)) {
    host_.close_all(*former);
    host_.drop(former->id());
  }
  const auto found = absentees_.find(ended);
  if (found == absentees_.end() || !is_that(client, found->second)) return;
  const std::size_t ports = found->second.ports.size();
  log::info("another node of the process of {} has ended without a daemon, and left {} port{}",
            client.description(), ports, ports == 1 ? "" : "s");
  give_up(ended);
}

Charge Takeover::make_room_for(const Client& newcomer, NodeId former) {
  const auto absentee = absentees_.find(former);
  if (absentee != absentees_.end() && is_that(newcomer, absentee->second) &&
      absentee->second.charge) {
    return std::move(absentee->second.charge);
  }
  return shares_.take(newcomer.user(), Share::kClients);
}

// Its ports may be another node's of the same program, which go on without us.
void Takeover::require_not_kept(const Client& asking, shm::PortInstance holder,
                                const std::string& what) {
  for (const auto& [node, absentee] : absentees_) {
    if (absentee.ports.count(holder) == 0) continue;
    if (has_ended(absentee.process)) {
      forget_absentee(node);
      return;
    }
    throw NotYet(
        what + " is kept for process " + std::to_string(absentee.pid) +
            (is_that(asking, absentee)
                 ? ", yours, which had it open and has not closed it: if you have executed "
                   "another program (exec), end the process and start anew"
                 : ", which lives but does not answer"),
        shm::monotonic_now() + kMaxWaitForDeath);
  }
  for (const auto& [id, client] : clients_) {
    if (client->to_hand_back.count(holder) != 0) {
      throw NotYet(what + " is kept for " + client->description(),
                   shm::monotonic_now() + kMaxWaitForDeath);
    }
  }
}

// What cannot be a port of its is not listed; it has been refused already.
void Takeover::hear_stranger(const Client& client, const wire::Message& message) noexcept {
  try {
    if (message.kind == wire::MessageKind::kHandBackOutput) {
      const std::string port = port_name(message);
      gate_.require(client, Action::kOutput, port);
      strangers_.has_output(client, port);
    } else if (message.kind == wire::MessageKind::kHandBackInput) {
      const std::string port = port_name(message);
      gate_.require(client, Action::kInput, port);
      strangers_.has_input(client, port);
    } else if (message.kind == wire::MessageKind::kHandedBack) {
      strangers_.has_said_all(client);
    }
  } catch (const std::exception&) {
  }
}

}  // namespace arbiter::service
