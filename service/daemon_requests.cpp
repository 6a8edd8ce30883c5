// What clients say and ask, but for what is about ports and sources.
#include <stdexcept>

#include "service/clients/given_names.hpp"
#include "service/clients/replies.hpp"
#include "service/daemon.hpp"
#include "service/log/event.hpp"
#include "service/log/log.hpp"
#include "service/policy/users.hpp"
#include "service/status.hpp"
#include "shm/assertion.hpp"
#include "shm/clock.hpp"
#include "shm/utf8.hpp"

namespace arbiter::service {
namespace {

void require_usable(const wire::Received& received) {
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

// They are numbered one after the other.
bool hands_back(wire::MessageKind kind) {
  return kind >= wire::MessageKind::kHandBackPage && kind <= wire::MessageKind::kHandedBack;
}

// What is not said while components come back to a new daemon.
bool is_question(wire::MessageKind kind) {
  using wire::MessageKind;
  return kind == MessageKind::kOpenOutput || kind == MessageKind::kOpenInput ||
         kind == MessageKind::kOpenTap || kind == MessageKind::kConnect ||
         kind == MessageKind::kReload || kind == MessageKind::kStatus ||
         kind == MessageKind::kDeactivate || kind == MessageKind::kObserve ||
         kind == MessageKind::kSwitch || kind == MessageKind::kRollback ||
         kind == MessageKind::kModel || kind == MessageKind::kMay;
}

}  // namespace

void Daemon::handle(Client& client, wire::Received& received) {
  const wire::Message& message = received.message;
  if (client.is_turned_away) {
    takeover_.hear_stranger(client, message);
    return;
  }
  require_usable(received);
  if (client.is_taken_anew && hands_back(message.kind)) return;
  if (client.node == 0 && message.kind != wire::MessageKind::kHello) {
    throw std::runtime_error("a client must say hello first");
  }
  if (!serves() && is_question(message.kind)) {
    throw NotYet("this daemon is taking over from another", shm::kForever);
  }
  if (hand_back(client, received) || change_model(client, message)) return;
  switch (message.kind) {
    case wire::MessageKind::kHello:
      hello(client, received);
      break;
    case wire::MessageKind::kOpenOutput:
      open_output(client, received);
      break;
    case wire::MessageKind::kOpenInput:
      open_input(client, received);
      break;
    case wire::MessageKind::kOpenTap:
      open_tap(client, received);
      break;
    case wire::MessageKind::kTapped:
      if (client.ports.count(message.port) != 0) {
        switchboard_.tell_tap(received);
        introductions_.show_growth_soon();
      }
      break;
    case wire::MessageKind::kClosePort:
      close_port(client, message.port);
      if (switchboard_.has_tap(client, message.port)) switchboard_.remove_tap(message.port);
      break;
    case wire::MessageKind::kSynced:
      barriers_.synced(client.id(), message.request);
      break;
    case wire::MessageKind::kStatus:
      gate_.require(client, Action::kObserve);
      status_requests_.add(client, message.request);
      break;
    case wire::MessageKind::kModel:
      gate_.require(client, Action::kObserve);
      send_model(client, message.request);
      break;
    case wire::MessageKind::kMay:
      gate_.require(client, Action::kObserve);
      say_whether_may(client, message);
      break;
    case wire::MessageKind::kDeactivate:
      deactivate(client, message);
      break;
    case wire::MessageKind::kObserve:
      gate_.require(client, Action::kObserve);
      observers_.add(client, message.request, names_.last_news());
      break;
    case wire::MessageKind::kPeerRefused:
      if (client.ports.count(message.port) != 0) {
        switchboard_.refuse(message.port, message.peer, shm::printable(message.text_view()));
      }
      break;
    case wire::MessageKind::kBlind:
      if (client.ports.count(message.port) != 0) {
        switchboard_.note_blind(message.port, std::string(message.text_view()));
      }
      break;
    case wire::MessageKind::kDescribe:
      if (client.ports.count(message.port) != 0) {
        switchboard_.describe(message.port,
                              {shm::printable(message.text_view()), message.value == 1});
      }
      break;
    case wire::MessageKind::kConnect:
      if (client.ports.count(message.port) == 0) throw std::runtime_error("the port is not open");
      connect(client, message.request, message.port);
      break;
    case wire::MessageKind::kNodeEnded:
      if (message.link == client.node) close_all(client);
      takeover_.forget_ended(client, message.link);
      break;
    case wire::MessageKind::kStop:
      gate_.require(client, Action::kStop);
      log_event({EventKind::kStopping, {client.name}}, log::level::info, "stopping: {} asks for it",
                client.description());
      client.send(reply_to(message.request, wire::MessageKind::kDone));
      stop_wanted_ = true;
      break;
    default:
      throw std::runtime_error("an unknown kind of message");
  }
}

bool Daemon::hand_back(Client& client, wire::Received& received) {
  switch (received.message.kind) {
    case wire::MessageKind::kHandBackPage:
      takeover_.take_back_page(client, received);
      return true;
    case wire::MessageKind::kHandBackOutput:
      takeover_.take_back_output(client, received);
      return true;
    case wire::MessageKind::kHandBackInput:
      takeover_.take_back_input(client, received);
      return true;
    case wire::MessageKind::kHandBackLink:
      takeover_.take_back_link(client, received.message);
      return true;
    case wire::MessageKind::kHandedBack:
      takeover_.finish_return(client);
      return true;
    default:
      return false;
  }
}

bool Daemon::change_model(Client& client, const wire::Message& message) {
  switch (message.kind) {
    case wire::MessageKind::kReload:
      ask_for_reload(client, message);
      return true;
    case wire::MessageKind::kSwitch:
      gate_.require(client, Action::kSwitch);
      ask_for_switch(client, message);
      return true;
    case wire::MessageKind::kRollback:
      gate_.require_rollback(client);
      changes_.ask({Change::Kind::kRollback, {}, message.link, {}, {}}, client, message);
      return true;
    default:
      return false;
  }
}

void Daemon::ask_for_reload(Client& client, const wire::Message& message) {
  Change change{Change::Kind::kReload, {}, 0, {}, {}};
  if ((message.flags & wire::kDryRun) != 0) {
    change.kind = Change::Kind::kCompare;
    change.of_past = (message.flags & wire::kGoesBack) != 0;
  }
  if (change.of_past) {
    gate_.require_rollback(client);
    change.generation = message.link;
  } else {
    gate_.require(client, Action::kReload);
  }
  changes_.ask(std::move(change), client, message);
}

void Daemon::ask_for_switch(Client& client, const wire::Message& message) {
  Change change{Change::Kind::kSwitch, std::string(message.name_view()), 0, {}, {}};
  if ((message.flags & wire::kDryRun) != 0) {
    changes_.ask_ahead(std::move(change), client, message);
  } else {
    changes_.ask(std::move(change), client, message);
  }
}

void Daemon::hello(Client& client, const wire::Received& received) {
  const wire::Message& message = received.message;
  if (!client.name.empty()) throw std::runtime_error("a client says hello once");
  if (message.value != wire::kWireVersion) {
    throw std::runtime_error("the client speaks version " + std::to_string(message.value) +
                             ", this daemon version " + std::to_string(wire::kWireVersion));
  }
  if (message.name_view().empty()) throw std::runtime_error("a client must have a name");
  require_fine(message.name_view(), "the client's");
  const bool is_known = takeover_.knows(received.descriptors[0]);
  const bool rejoins = (message.flags & wire::kRejoins) != 0;
  const bool returns = rejoins && (is_known || (message.flags & wire::kHasNoPorts) == 0);
  client.charge = takeover_.make_room_for(client, returns && is_known ? message.link : 0);
  client.name = message.name_view();
  client.hello_request = message.request;
  client.has_service_thread = (message.flags & wire::kHasServiceThread) != 0;
  client.comes_back = (message.flags & wire::kComesBack) != 0;
  client.is_taken_anew = rejoins && !returns;
  if (returns) {
    takeover_.rejoin(client, received);
  } else if (serves()) {
    welcome(client);
  } else {
    takeover_.let_wait(client);
  }
}

void Daemon::welcome(Client& client) {
  if (client.node == 0) client.node = registry_.next_node();
  auto welcome = reply_to(client.hello_request, wire::MessageKind::kWelcome);
  welcome.link = client.node;
  welcome.peer = static_cast<std::uint64_t>(shm::monotonic_now());
  takeover_.know(client);
  client.send(welcome, {board_.readable().get(), registry_.readable().get()});
  log::debug("{} is here", client.description());
}

// For a program that lets others look through it, such as a link.
void Daemon::say_whether_may(Client& client, const wire::Message& message) {
  const std::string name(message.name_view());
  const auto action = action_on_no_port(name);
  if (!action) throw std::runtime_error("there is no action \"" + shm::printable(name) + '"');
  gate_.require(identity_of(message.value, message.text_view()), *action);
  client.send(reply_to(message.request, wire::MessageKind::kDone));
}

// One document for all who have asked by now.
void Daemon::answer_status(shm::Nanoseconds now) {
  if (!status_requests_.are_due(now)) return;
  shm::FileDescriptor document;
  std::string why_not;
  try {
    document = make_document(status_document(
        {instance_, board_, changes_.library(), changes_.in_force(), changes_.history(), names_,
         registry_, switchboard_, takeover_.strangers(), takeover_.deaths(), refusals_,
         clients_.size(), changes_.reloads_refused(), changes_.refused_files()},
        now));
  } catch (const std::exception& error) {  // no descriptors are left
    why_not = error.what();
  }
  for (const StatusRequests::Asking& each : status_requests_.take()) {
    Client* const asking = clients_.find(each.client);
    if (asking == nullptr) continue;
    Client& client = *asking;
    ARBITER_ASSERT(client.waits_for_status != 0,
                   "a client is sent more documents than it asked for");
    --client.waits_for_status;
    if (document) {
      client.send(reply_to(each.request, wire::MessageKind::kStatusReply), {document.get(), -1});
    } else {
      refuse(client, each.request, why_not);
    }
  }
  status_requests_.made(now, shm::monotonic_now());
}

void Daemon::send_model(Client& client, std::uint64_t request) {
  client.send(reply_to(request, wire::MessageKind::kModelReply), {changes_.document().get(), -1});
}

}  // namespace arbiter::service
