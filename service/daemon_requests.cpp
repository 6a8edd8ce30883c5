// What clients ask of the daemon.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>
#include <string_view>

#include "service/daemon.hpp"
#include "service/log.hpp"
#include "service/status.hpp"
#include "shm/clock.hpp"
#include "shm/utf8.hpp"

namespace arbiter::service {
namespace {

// How long a name is asked for in vain that a component has whose conversation is lost: it may be
// dying.
constexpr shm::Nanoseconds kMaxWaitForDeath = 100'000'000;

// Logs, status and terminals show what clients call themselves and their ports: no name may break a
// line of theirs, or mislead those who read it.
void require_fine(std::string_view name, const char* whose) {
  if (const auto fault = shm::find_fault_in_name(name)) {
    throw std::runtime_error(std::string(whose) + " name \"" + shm::printable(name) + "\" has " +
                             fault->what + " in it");
  }
}

std::string port_name(const shm::Message& message) {
  const std::string_view name = message.name_view();
  if (name.empty() || name[0] != '/') throw std::runtime_error("a port's name begins with '/'");
  require_fine(name, "the port's");
  return std::string(name);
}

void require_usable(const shm::Received& received) {
  if (received.is_strange) {
    throw std::runtime_error(
        "a descriptor of the message is neither a memfd nor an anonymous pipe: nothing else is "
        "taken");
  }
  if (received.lost_descriptors) {
    throw std::runtime_error(
        "the daemon has no descriptor left (RLIMIT_NOFILE, LimitNOFILE= in its systemd unit)");
  }
}

// What is not said while components come back to a new daemon.
bool is_question(shm::MessageKind kind) {
  using shm::MessageKind;
  return kind == MessageKind::kOpenOutput || kind == MessageKind::kOpenInput ||
         kind == MessageKind::kConnect || kind == MessageKind::kReload ||
         kind == MessageKind::kStatus || kind == MessageKind::kDeactivate ||
         kind == MessageKind::kObserve || kind == MessageKind::kSwitch ||
         kind == MessageKind::kRollback || kind == MessageKind::kModel;
}

}  // namespace

void Daemon::handle(Client& client, shm::Received& received) {
  const shm::Message& message = received.message;
  if (client.is_turned_away) {
    hear_stranger(client, message);
    return;
  }
  require_usable(received);
  if (client.node == 0 && message.kind != shm::MessageKind::kHello) {
    throw std::runtime_error("a client must say hello first");
  }
  if (phase_ != Phase::kServing && is_question(message.kind)) {
    throw NotYet("this daemon is taking over from another", shm::kForever);
  }
  switch (message.kind) {
    case shm::MessageKind::kHello:
      hello(client, received);
      break;
    case shm::MessageKind::kOpenOutput:
      open_output(client, received);
      break;
    case shm::MessageKind::kOpenInput:
      open_input(client, received);
      break;
    case shm::MessageKind::kClosePort:
      close_port(client, message.port);
      break;
    case shm::MessageKind::kSynced:
      barriers_.synced(client.id(), message.request);
      break;
    case shm::MessageKind::kStatus:
      gate_.require(client, Action::kObserve);
      status_requests_.add(client, message.request);
      break;
    case shm::MessageKind::kModel:
      gate_.require(client, Action::kObserve);
      send_model(client, message.request);
      break;
    case shm::MessageKind::kDeactivate:
      deactivate(client, message);
      break;
    case shm::MessageKind::kObserve:
      gate_.require(client, Action::kObserve);
      observers_.add(client, message.request, directory_.last_news());
      break;
    case shm::MessageKind::kPeerRefused:
      if (client.ports.count(message.port) != 0) {
        switchboard_.refuse(message.port, message.peer, shm::printable(message.text_view()));
      }
      break;
    case shm::MessageKind::kBlind:
      if (client.ports.count(message.port) != 0) {
        switchboard_.note_blind(message.port, std::string(message.text_view()));
      }
      break;
    case shm::MessageKind::kHandBackPage:
      take_back_page(client, received);
      break;
    case shm::MessageKind::kHandBackOutput:
      take_back_output(client, received);
      break;
    case shm::MessageKind::kHandBackInput:
      take_back_input(client, received);
      break;
    case shm::MessageKind::kHandBackLink:
      take_back_link(client, message);
      break;
    case shm::MessageKind::kHandedBack:
      finish_return(client);
      break;
    case shm::MessageKind::kConnect:
      if (client.ports.count(message.port) == 0) throw std::runtime_error("the port is not open");
      connect(client, message.request, message.port);
      break;
    case shm::MessageKind::kReload:
      gate_.require(client, Action::kReload);
      ask_for({(message.flags & shm::kDryRun) != 0 ? Change::Kind::kCompare : Change::Kind::kReload,
               {},
               0,
               {},
               {}},
              client, message);
      break;
    case shm::MessageKind::kSwitch:
      gate_.require(client, Action::kSwitch);
      ask_for({Change::Kind::kSwitch, std::string(message.name_view()), 0, {}, {}}, client,
              message);
      break;
    case shm::MessageKind::kRollback:
      gate_.require(client, Action::kReload);
      ask_for({Change::Kind::kRollback, {}, message.link, {}, {}}, client, message);
      break;
    case shm::MessageKind::kStop:
      gate_.require(client, Action::kStop);
      log::info("stopping: {} asks for it", client.description());
      client.send(reply_to(message.request, shm::MessageKind::kDone));
      stop_wanted_ = true;
      break;
    default:
      throw std::runtime_error("an unknown kind of message");
  }
}

// `returning`: the node that the newcomer says it was, if it was here before.
Charge Daemon::make_room_for(const Client& newcomer, NodeId returning) {
  const auto absentee = absentees_.find(returning);
  if (absentee != absentees_.end() &&
      newcomer.is_process(absentee->second.pid, absentee->second.process.get())) {
    return std::move(absentee->second.charge);
  }
  return shares_.take(newcomer.user(), Share::kClients);
}

void Daemon::hello(Client& client, const shm::Received& received) {
  const shm::Message& message = received.message;
  if (!client.name.empty()) throw std::runtime_error("a client says hello once");
  if (message.value != shm::kWireVersion) {
    throw std::runtime_error("the client speaks version " + std::to_string(message.value) +
                             ", this daemon version " + std::to_string(shm::kWireVersion));
  }
  if (message.name_view().empty()) throw std::runtime_error("a client must have a name");
  require_fine(message.name_view(), "the client's");
  client.charge = make_room_for(client, (message.flags & shm::kRejoins) != 0 ? message.link : 0);
  client.name = message.name_view();
  client.hello_request = message.request;
  client.has_service_thread = (message.flags & shm::kHasServiceThread) != 0;
  client.comes_back = (message.flags & shm::kComesBack) != 0;
  if ((message.flags & shm::kRejoins) != 0) {
    try {
      rejoin(client, received);
    } catch (const std::exception& error) {
      client.is_turned_away = true;
      const std::string why = error.what();
      if (!strangers_.refuse(client, message.link, why, shm::monotonic_now())) {
        throw RefusedAgain(why);
      }
      throw;
    }
  } else if (phase_ == Phase::kServing) {
    welcome(client);
  } else {
    waiting_.push_back(client.id());
  }
}

// What cannot be a port of its is not listed; it has been refused already.
void Daemon::hear_stranger(const Client& client, const shm::Message& message) noexcept {
  try {
    if (message.kind == shm::MessageKind::kHandBackOutput) {
      const std::string port = port_name(message);
      gate_.require(client, Action::kOutput, port);
      strangers_.has_output(client, port);
    } else if (message.kind == shm::MessageKind::kHandBackInput) {
      const std::string port = port_name(message);
      gate_.require(client, Action::kInput, port);
      strangers_.has_input(client, port);
    } else if (message.kind == shm::MessageKind::kHandedBack) {
      strangers_.has_said_all(client);
    }
  } catch (const std::exception&) {
  }
}

void Daemon::welcome(Client& client) {
  if (client.node == 0) client.node = registry_.next_node();
  auto welcome = reply_to(client.hello_request, shm::MessageKind::kWelcome);
  welcome.link = client.node;
  welcome.peer = static_cast<std::uint64_t>(shm::monotonic_now());
  strangers_.welcome(client);
  client.send(welcome, {models_.board().get(), registry_.readable().get()});
  log::debug("{} is here", client.description());
}

void Daemon::require_free(const Client& asking, shm::PortInstance holder, const std::string& what) {
  if (holder == 0) return;
  Client* client = nullptr;
  if (const auto* output = switchboard_.output(holder)) client = output->client;
  if (const auto* input = switchboard_.input(holder)) client = input->client;
  if (client == nullptr) return;
  if (client != &asking) {
    if (client->has_died()) {
      drop(client->id());
      return;
    }
    // What others sent earlier may come later, for each has a socket of its own.
    client->read_ahead();
    if (client->take_closing_of(holder)) {
      switchboard_.remove(holder);
      return;
    }
  }
  throw std::runtime_error(what + " is held by " + client->description());
}

void Daemon::require_not_kept(shm::PortInstance holder, const std::string& what) {
  for (const auto& [node, absentee] : absentees_) {
    if (absentee.ports.count(holder) == 0) continue;
    if (has_ended(absentee.process)) {
      forget_absentee(node);
      return;
    }
    throw NotYet(what + " is kept for process " + std::to_string(absentee.pid) +
                     ", which lives but does not answer",
                 shm::monotonic_now() + kMaxWaitForDeath);
  }
  for (const auto& [id, client] : clients_) {
    if (client->to_hand_back.count(holder) != 0) {
      throw NotYet(what + " is kept for " + client->description(),
                   shm::monotonic_now() + kMaxWaitForDeath);
    }
  }
}

void Daemon::open_output(Client& client, shm::Received& received) {
  const std::string name = port_name(received.message);
  gate_.require(client, Action::kOutput, name);
  auto port = adopt_output(received, client.user());
  directory_.give_back(shm::monotonic_now());  // what this client may have closed just before
  port->charge = shares_.take(client.user(), Share::kDescriptors, kDescriptorsOfOutput);
  Source& source = directory_.source(name, client.user());
  directory_.let_go(source);  // if it is not opened after all
  require_free(client, source.open, "the output port " + name);
  require_not_kept(source.away, "the output port " + name);
  require_not_changing(source);
  const std::uint64_t request = received.message.request;
  if (Directory::may_be_given(source, client.user())) {
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
  remember_component(client);
  directory_.give_page(source, client.user());
  const OutputPort& opened = switchboard_.add(std::move(port), client, source);
  auto reply = reply_to(request, shm::MessageKind::kOpened);
  reply.port = opened.instance;
  reply.id = source.id;
  client.send(reply, {source.page.writable.get(), -1});
  log::info("{} opened output port {}", client.description(), source.name);
  connect(client, request, opened.instance);
}

void Daemon::open_input(Client& client, shm::Received& received) {
  const std::string name = port_name(received.message);
  gate_.require(client, Action::kInput, name);
  auto port = adopt_input(received, client.user());
  directory_.give_back(shm::monotonic_now());
  port->charge = shares_.take(client.user(), Share::kDescriptors, kDescriptorsOfInput);
  InputName& input = directory_.input(name, client.user());
  directory_.let_go(input);
  require_free(client, input.open, "the input port " + name);
  require_not_kept(input.away, "the input port " + name);
  remember_component(client);
  const InputPort& opened = switchboard_.add(std::move(port), client, input);
  auto reply = reply_to(received.message.request, shm::MessageKind::kOpened);
  reply.port = opened.instance;
  reply.id = input.id;
  client.send(reply);
  log::info("{} opened input port {}", client.description(), name);
  connect(client, received.message.request, opened.instance);
}

// Introduces a new port to its peers, and tells its component once they know it.
void Daemon::connect(Client& client, std::uint64_t request, shm::PortInstance port) {
  const auto in_force = models_.in_force();
  auto told = switchboard_.link_one(in_force.table, port);
  switchboard_.tell_unmentioned(in_force, port);
  // Hears of it in order, before the kConnected. But its receivers have to wait for an output port.
  if (switchboard_.output(port) == nullptr) told.erase(&client);
  introduce(told, [this, id = client.id(), request] {
    const auto found = clients_.find(id);
    if (found == clients_.end()) return;
    found->second->send(reply_to(request, shm::MessageKind::kConnected));
  });
}

// Calls `passed` once clients have taken up what they were told: first the publishers, which
// thereby use more of their segments, then the receivers that map it.
void Daemon::introduce(const Switchboard::Told& told, std::function<void()> passed) {
  const shm::Nanoseconds deadline = shm::monotonic_now() + kMaxWaitForClients;
  barriers_.raise(told, deadline, [this, deadline, passed = std::move(passed)] {
    const auto receivers = switchboard_.show_segments();
    if (switchboard_.has_growth_to_show() && show_growth_at_ == shm::kForever) {
      show_growth_at_ = shm::monotonic_now() + kShowGrowthAfter;
    }
    barriers_.raise(receivers, deadline, passed);
  });
}

void Daemon::close_port(Client& client, shm::PortInstance port) {
  if (client.ports.count(port) == 0) return;
  switchboard_.remove(port);
}

// One document for all who have asked by now.
void Daemon::answer_status(shm::Nanoseconds now) {
  if (!status_requests_.are_due(now)) return;
  shm::FileDescriptor document;
  std::string why_not;
  try {
    document = make_document(
        status_document({instance_, models_, library_, in_force_.model, history_, directory_,
                         registry_, switchboard_, strangers_, clients_.size(), reloads_refused_},
                        now));
  } catch (const std::exception& error) {  // no descriptors are left
    why_not = error.what();
  }
  for (const StatusRequests::Asking& each : status_requests_.take()) {
    const auto found = clients_.find(each.client);
    if (found == clients_.end()) continue;
    Client& client = *found->second;
    --client.waits_for_status;
    if (document) {
      client.send(reply_to(each.request, shm::MessageKind::kStatusReply), {document.get(), -1});
    } else {
      refuse(client, each.request, why_not);
    }
  }
  status_requests_.made(now, shm::monotonic_now());
}

shm::FileDescriptor Daemon::make_document(const std::string& document) {
  const auto file = shm::make_segment("arbiter-document", document.size());
  if (pwrite(file.get(), document.data(), document.size(), 0) !=
      static_cast<ssize_t>(document.size())) {
    throw std::runtime_error("the document could not be written");
  }
  return shm::reopen(file, O_RDONLY);
}

void Daemon::send_document(Client& client, std::uint64_t request, shm::MessageKind kind,
                           const std::string& document) {
  client.send(reply_to(request, kind), {make_document(document).get(), -1});
}

void Daemon::send_model(Client& client, std::uint64_t request) {
  auto reply = reply_to(request, shm::MessageKind::kModelReply);
  const ModelCopyOf of{models_, library_, in_force_.model, history_, continuity_};
  client.send(reply, {model_copy_.of(of).get(), -1});
}

void Daemon::deactivate(Client& client, const shm::Message& message) {
  const std::string name = port_name(message);
  gate_.require(client, Action::kDeactivate, name);
  Source* source = directory_.find_source(name);
  if (source == nullptr) {
    throw std::runtime_error("no model and no component has named the source " + name);
  }
  require_free(client, source->open, "the output port " + name);
  require_not_kept(source->away, "the output port " + name);
  require_not_changing(*source);
  if (!source->has_page()) throw std::runtime_error("nobody has the activity of " + name);
  const bool was_active = end_activity(*source);
  const auto answer = [this, was_active, request = message.request](Source& ended, Client& asking) {
    end_activity(ended);  // who had it may have written there until it was replaced
    directory_.let_go(ended);
    auto reply = reply_to(request, shm::MessageKind::kDone);
    reply.value = was_active ? 1 : 0;
    asking.send(reply);
    log::info("{} deactivated {}{}", asking.description(), ended.name,
              was_active ? "" : ", which was not active");
  };
  if (was_active && may_undo(*source)) {
    change_page(*source, client, message.request, {}, answer);
  } else {
    answer(*source, client);
  }
}

void Daemon::refuse(Client& client, std::uint64_t request, const std::string& why) {
  auto reply = reply_to(request, shm::MessageKind::kRefused);
  reply.set_text(why);
  client.send(reply);
}

}  // namespace arbiter::service
