#include "service/daemon.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/epoll.h>
#include <sys/mman.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "service/log.hpp"
#include "service/status.hpp"
#include "shm/clock.hpp"

namespace arbiter::service {
namespace {

// How long a component that does not run may hold up the opening of a port, or a new model.
constexpr shm::Nanoseconds kMaxWaitForClients = 200'000'000;

// How long a name is asked for in vain that a component has whose conversation is lost: it may be
// dying.
constexpr shm::Nanoseconds kMaxWaitForDeath = 100'000'000;

// How many messages of one client are handled before it is the next one's turn.
constexpr int kMaxMessagesAtOnce = 64;

shm::Message reply_to(std::uint64_t request, shm::MessageKind kind) {
  shm::Message message;
  message.kind = kind;
  message.request = request;
  return message;
}

// Logs and status are read by people and by programs: no name may break a line of theirs.
bool is_printable(std::string_view name) {
  return std::all_of(name.begin(), name.end(),
                     [](char c) { return static_cast<unsigned char>(c) > ' ' && c != '\x7f'; });
}

std::string port_name(const shm::Message& message) {
  const std::string_view name = message.name_view();
  if (name.empty() || name[0] != '/') throw std::runtime_error("a port's name begins with '/'");
  if (!is_printable(name)) throw std::runtime_error("a port's name has no white space");
  return std::string(name);
}

// What is not said while components come back to a new daemon.
bool is_question(shm::MessageKind kind) {
  using shm::MessageKind;
  return kind == MessageKind::kOpenOutput || kind == MessageKind::kOpenInput ||
         kind == MessageKind::kConnect || kind == MessageKind::kReload ||
         kind == MessageKind::kStatus || kind == MessageKind::kDeactivate ||
         kind == MessageKind::kObserve;
}

std::uint64_t event_key(std::uint32_t tag, ClientId client) {
  return std::uint64_t{tag} << 56 | client;
}

}  // namespace

Daemon::Daemon(const DaemonOptions& options)
    : instance_(options.instance),
      stores_(options.uses_descriptor_store),
      gate_(options.policy),
      models_(options.files, directory_),
      state_(options.directory, options.instance) {
  gate_.prepare();
  gate_.put_in_force();
  if (models_.has_files()) models_.read();
  listener_ = shm::listen_at(options.directory, instance_);
  epoll_.reset(epoll_create1(EPOLL_CLOEXEC));
  if (!epoll_) throw std::system_error(errno, std::generic_category(), "epoll_create1");
  watch(listener_.socket.get(), Tag::kListener, 0, EPOLLIN);
  reserve_.reset(open("/dev/null", O_RDONLY | O_CLOEXEC));
  look_for_predecessor();
}

// Components that live on need the state file to come back by, as what the service manager keeps does.
Daemon::~Daemon() {
  unlink(listener_.path.c_str());
  if (!stores_ && phase_ == Phase::kServing && clients_.empty() && absentees_.empty()) state_.remove();
}

void Daemon::watch(int fd, Tag tag, ClientId client, std::uint32_t events) {
  epoll_event event{};
  event.events = events;
  event.data.u64 = event_key(static_cast<std::uint32_t>(tag), client);
  if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, fd, &event) != 0 &&
      (errno != EEXIST || epoll_ctl(epoll_.get(), EPOLL_CTL_MOD, fd, &event) != 0)) {
    throw std::system_error(errno, std::generic_category(), "epoll_ctl");
  }
}

int Daemon::timeout_ms() const {
  const bool is_behind = std::any_of(clients_.begin(), clients_.end(), [](const auto& each) {
    return each.second->has_read_ahead();
  });
  if (is_behind || (try_postponed_ && !postponed_.empty())) return 0;
  shm::Nanoseconds deadline = std::min(barriers_.next_deadline(), takeover_deadline());
  for (const Postponed& request : postponed_) deadline = std::min(deadline, request.deadline);
  if (deadline == shm::kForever) return -1;
  const shm::Nanoseconds left = std::max<shm::Nanoseconds>(deadline - shm::monotonic_now(), 0);
  return static_cast<int>(left / 1'000'000 + 1);
}

void Daemon::run(int signal_descriptor) {
  watch(signal_descriptor, Tag::kSignals, 0, EPOLLIN);
  for (;;) {
    epoll_event events[64];
    const int count = epoll_wait(epoll_.get(), events, 64, timeout_ms());
    if (count < 0 && errno != EINTR) {
      throw std::system_error(errno, std::generic_category(), "epoll_wait");
    }
    for (int i = 0; i < count; ++i) {
      const auto tag = static_cast<Tag>(events[i].data.u64 >> 56);
      const ClientId id = events[i].data.u64 & ((std::uint64_t{1} << 56) - 1);
      if (tag == Tag::kListener) accept_client();
      if (tag == Tag::kSignals && handle_signal(signal_descriptor)) return;
      if (tag == Tag::kAbsentee) {
        forget_absentee(id);
        continue;
      }
      const auto client = clients_.find(id);
      if (client == clients_.end()) continue;
      if (tag == Tag::kClient && (events[i].events & EPOLLOUT) != 0) client->second->flush();
      if (tag == Tag::kClient && (events[i].events & ~EPOLLOUT) != 0) serve(*client->second);
      // What it sent before it died is served first.
      if (tag == Tag::kProcess) {
        serve(*client->second);
        drop(id);
      }
    }
    const shm::Nanoseconds now = shm::monotonic_now();
    barriers_.expire(now);
    advance_takeover(now);
    serve_postponed(now);
    settle();
    if (stop_wanted_) return;
  }
}

bool Daemon::handle_signal(int signal_descriptor) {
  signalfd_siginfo info{};
  while (::read(signal_descriptor, &info, sizeof info) == static_cast<ssize_t>(sizeof info)) {
    if (info.ssi_signo == SIGHUP) {
      reload();
      continue;
    }
    log::info("stopping: signal {}", info.ssi_signo);
    return true;
  }
  return false;
}

void Daemon::accept_client() {
  for (;;) {
    shm::FileDescriptor socket(
        accept4(listener_.socket.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!socket) {
      if (errno == EMFILE || errno == ENFILE) {
        turn_away_client();
      } else if (errno != EAGAIN && errno != ECONNABORTED) {
        log::warn("accept: {}", std::strerror(errno));
      }
      return;
    }
    try {
      const ClientId id = ++last_client_;
      auto client = std::make_unique<Client>(id, std::move(socket));
      watch(client->socket(), Tag::kClient, id, EPOLLIN | EPOLLRDHUP);
      if (client->process() >= 0) watch(client->process(), Tag::kProcess, id, EPOLLIN);
      clients_.emplace(id, std::move(client));
      drop_oldest_silent_client();
    } catch (const std::exception& error) {
      log::warn("a client was turned away: {}", error.what());
    }
    return;
  }
}

// Else it would stay in the listener's queue, and the loop would never rest.
void Daemon::turn_away_client() {
  reserve_.reset();
  const shm::FileDescriptor socket(accept4(listener_.socket.get(), nullptr, nullptr, SOCK_CLOEXEC));
  log::warn("a client was turned away: no descriptors are left");
  reserve_.reset(open("/dev/null", O_RDONLY | O_CLOEXEC));
}

// Whoever connects and says nothing costs two descriptors, and gives way to those who come later.
void Daemon::drop_oldest_silent_client() {
  ClientId oldest = 0;
  std::size_t count = 0;
  for (const auto& [id, client] : clients_) {
    if (!client->name.empty()) continue;
    if (count++ == 0) oldest = id;
  }
  if (count > shm::kMaxSilentClients) drop(oldest);
}

void Daemon::require_room_for(const Client& newcomer) const {
  std::size_t count = 0;
  std::size_t of_the_user = 0;
  for (const auto& [id, client] : clients_) {
    if (client->node == 0) continue;
    ++count;
    if (client->user() == newcomer.user()) ++of_the_user;
  }
  const auto refuse = [](const char* what, std::uint32_t limit) {
    throw std::length_error("limit-exceeded: there are " + std::to_string(limit) + " clients " +
                            what + " already, the most there can be");
  };
  if (count >= shm::kMaxClients) refuse("(kMaxClients)", shm::kMaxClients);
  if (of_the_user >= shm::kMaxClientsPerUser) {
    refuse("of this user (kMaxClientsPerUser)", shm::kMaxClientsPerUser);
  }
}

void Daemon::serve(Client& client) {
  const ClientId id = client.id();
  shm::Received received;
  for (int i = 0; i < kMaxMessagesAtOnce; ++i) {
    switch (client.receive(received)) {
      case shm::ReceiveResult::kNothing:
        return;
      case shm::ReceiveResult::kReceived:
        break;
      case shm::ReceiveResult::kMalformed:
        log::warn("{} sent what is no message; dropped", client.description());
        drop(id);
        return;
      case shm::ReceiveResult::kClosed:
        drop(id);
        return;
    }
    handle_or_refuse(client, received, shm::kForever);
    if (clients_.count(id) == 0) return;
  }
}

// `deadline`: of a request that was postponed.
void Daemon::handle_or_refuse(Client& client, shm::Received& received, shm::Nanoseconds deadline) {
  const std::uint64_t request = received.message.request;
  std::string why;
  try {
    handle(client, received);
    return;
  } catch (const NotYet& not_yet) {
    why = not_yet.what();
    deadline = std::min(deadline, not_yet.deadline);
    if (shm::monotonic_now() < deadline) {
      auto postponed = std::make_unique<shm::Received>(std::move(received));
      postponed_.push_back({client.id(), std::move(postponed), deadline});
      return;
    }
  } catch (const std::exception& error) {
    why = error.what();
  }
  log::warn("{}: {}", client.description(), why);
  refuse(client, request, why);
}

void Daemon::drop(ClientId id) {
  const auto found = clients_.find(id);
  if (found == clients_.end()) return;
  const std::unique_ptr<Client> client = std::move(found->second);
  clients_.erase(found);
  if (!client->name.empty()) {
    log::info("{} left, {} ports with it", client->description(), client->ports.size());
  }
  if (client->comes_back && !client->has_died()) set_away(*client);
  while (!client->ports.empty()) switchboard_.remove(*client->ports.begin());
  for (const shm::PortInstance port : client->to_hand_back) switchboard_.forget_away(port);
  barriers_.forget(id);
}

// After each round: sends what is queued, and drops who is lost.
void Daemon::settle() {
  std::vector<ClientId> read_ahead;
  for (const auto& [id, client] : clients_) {
    if (client->has_read_ahead()) read_ahead.push_back(id);
  }
  for (const ClientId id : read_ahead) {
    const auto client = clients_.find(id);
    if (client != clients_.end()) serve(*client->second);
  }
  std::vector<ClientId> lost;
  for (const auto& [id, client] : clients_) {
    if (client->is_lost()) {
      lost.push_back(id);
    } else {
      const std::uint32_t out = client->has_queue() ? static_cast<std::uint32_t>(EPOLLOUT) : 0u;
      if (out != 0 || client->watches_queue) {
        watch(client->socket(), Tag::kClient, id, EPOLLIN | EPOLLRDHUP | out);
        client->watches_queue = out != 0;
      }
    }
  }
  for (const ClientId id : lost) drop(id);
  if (reload_wanted_ && !swapping_ && phase_ == Phase::kServing) {
    reload_wanted_ = false;
    reload();
  }
}

void Daemon::handle(Client& client, shm::Received& received) {
  const shm::Message& message = received.message;
  if (client.is_turned_away) return;
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
      send_status(client, message.request);
      break;
    case shm::MessageKind::kDeactivate:
      deactivate(client, message);
      break;
    case shm::MessageKind::kObserve:
      gate_.require(client, Action::kObserve);
      client.observes = true;
      switchboard_.show_everything(client);
      client.send(reply_to(message.request, shm::MessageKind::kDone));
      break;
    case shm::MessageKind::kPeerRefused:
      if (client.ports.count(message.port) != 0) {
        switchboard_.refuse(message.port, message.peer, std::string(message.text_view()));
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
      reload(client.id(), message.request);
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

void Daemon::hello(Client& client, const shm::Received& received) {
  const shm::Message& message = received.message;
  if (!client.name.empty()) throw std::runtime_error("a client says hello once");
  if (message.value != shm::kWireVersion) {
    throw std::runtime_error("the client speaks version " + std::to_string(message.value) +
                             ", this daemon version " + std::to_string(shm::kWireVersion));
  }
  if (message.name_view().empty() || !is_printable(message.name_view())) {
    throw std::runtime_error("a client must have a name, without white space");
  }
  require_room_for(client);
  client.name = message.name_view();
  client.has_service_thread = (message.flags & shm::kHasServiceThread) != 0;
  client.comes_back = (message.flags & shm::kComesBack) != 0;
  if ((message.flags & shm::kRejoins) != 0) {
    try {
      rejoin(client, received);
    } catch (...) {
      client.is_turned_away = true;
      throw;
    }
  } else if (phase_ == Phase::kServing) {
    welcome(client);
  } else {
    waiting_.push_back(client.id());
  }
}

void Daemon::welcome(Client& client) {
  if (client.node == 0) client.node = registry_.next_node();
  auto welcome = reply_to(0, shm::MessageKind::kWelcome);
  welcome.link = client.node;
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
  auto port = adopt_output(received);
  Source& source = directory_.source(name);
  require_free(client, source.open, "the output port " + name);
  require_not_kept(source.away, "the output port " + name);
  remember_component(client);
  const OutputPort& opened = switchboard_.add(std::move(port), client, source);
  auto reply = reply_to(received.message.request, shm::MessageKind::kOpened);
  reply.port = opened.instance;
  reply.id = source.id;
  client.send(reply, {source.writable.get(), -1});
  log::info("{} opened output port {}", client.description(), name);
  connect(client, received.message.request, opened.instance);
}

void Daemon::open_input(Client& client, shm::Received& received) {
  const std::string name = port_name(received.message);
  gate_.require(client, Action::kInput, name);
  auto port = adopt_input(received);
  InputName& input = directory_.input(name);
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
  auto told = switchboard_.link_one(models_.in_force().table, port);
  told.erase(&client);  // hears of it in order, before the kConnected
  for (const auto& [id, other] : clients_) {
    if (other->observes) switchboard_.show_everything(*other);
  }
  barriers_.raise(told, shm::monotonic_now() + kMaxWaitForClients,
                  [this, id = client.id(), request] {
                    const auto found = clients_.find(id);
                    if (found == clients_.end()) return;
                    found->second->send(reply_to(request, shm::MessageKind::kConnected));
                  });
}

void Daemon::close_port(Client& client, shm::PortInstance port) {
  if (client.ports.count(port) == 0) return;
  switchboard_.remove(port);
}

void Daemon::send_status(Client& client, std::uint64_t request) {
  const std::string document = status_document(
      {instance_, models_, directory_, switchboard_, clients_.size(), reloads_refused_},
      shm::monotonic_now());
  const auto file = shm::make_segment("arbiter-status", document.size());
  if (pwrite(file.get(), document.data(), document.size(), 0) !=
      static_cast<ssize_t>(document.size())) {
    throw std::runtime_error("the status document could not be written");
  }
  client.send(reply_to(request, shm::MessageKind::kStatusReply),
              {shm::reopen(file, O_RDONLY).get(), -1});
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
  if (!source->has_page()) throw std::runtime_error("nobody has the activity of " + name);
  const shm::Nanoseconds now = shm::monotonic_now();
  const bool was_active =
      shm::is_active(source->activity().word.load(std::memory_order_relaxed), now);
  source->activity().word.store(shm::deactivation(now), std::memory_order_relaxed);
  shm::full_fence();  // (a): as a publisher's own deactivate()
  switchboard_.ring_concerned(models_.in_force().table, source->id);
  auto reply = reply_to(message.request, shm::MessageKind::kDone);
  reply.value = was_active ? 1 : 0;
  client.send(reply);
  log::info("{} deactivated {}", client.description(), name);
}

void Daemon::refuse(Client& client, std::uint64_t request, const std::string& why) {
  auto reply = reply_to(request, shm::MessageKind::kRefused);
  reply.set_text(why);
  client.send(reply);
}

void Daemon::reload(ClientId asking, std::uint64_t request) {
  reloads_asked_.push_back({asking, request});
  reload();
}

// The new table is written and its clients are told before it counts; they switch all at once.
void Daemon::reload() {
  if (swapping_ || phase_ != Phase::kServing) {
    reload_wanted_ = true;
    return;
  }
  reloads_running_ = std::exchange(reloads_asked_, {});
  try {
    if (!models_.has_files() && !gate_.has_file()) {
      throw std::runtime_error("there is no file to read again; start with --model");
    }
    gate_.prepare();
    if (models_.has_files()) {
      models_.read();
      models_.prepare();
    }
  } catch (const std::exception& error) {
    ++reloads_refused_;
    log::error("the model in force stays: {}", error.what());
    answer_reloads(error.what());
    return;
  }
  if (!models_.has_files()) {
    gate_.put_in_force();
    answer_reloads({});
    return;
  }
  begin_swap();
}

void Daemon::begin_swap() {
  swapping_ = true;
  const auto told = switchboard_.link_all(models_.prepared());
  barriers_.raise(told, shm::monotonic_now() + kMaxWaitForClients, [this] { put_in_force(); });
}

void Daemon::put_in_force() {
  gate_.put_in_force();
  models_.put_in_force();
  swapping_ = false;
  const auto snapshot = models_.in_force();
  switchboard_.link_all(snapshot.table);  // ports that were opened meanwhile
  switchboard_.unlink(snapshot.table);
  switchboard_.ring_all();
  for (const auto& [id, client] : clients_) {
    if (client->observes) switchboard_.show_everything(*client);
  }
  log::info("model {} is in force", snapshot.generation);
  welcome_waiting();
  answer_reloads({});
}

void Daemon::answer_reloads(const std::string& why_not) {
  for (const ReloadRequest& each : std::exchange(reloads_running_, {})) {
    const auto client = clients_.find(each.client);
    if (client == clients_.end()) continue;
    if (!why_not.empty()) {
      refuse(*client->second, each.request, why_not);
      continue;
    }
    auto reply = reply_to(each.request, shm::MessageKind::kDone);
    reply.value = static_cast<std::uint32_t>(models_.in_force().generation);
    client->second->send(reply);
  }
}

}  // namespace arbiter::service
