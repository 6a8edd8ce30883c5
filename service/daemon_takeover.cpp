// How a daemon takes over from its predecessor: what was killed, or stopped, while its components
// went on.
//
// All that decides lives in memory that the components map: tables, activity, queues. The new
// daemon takes up that very memory and its numbers, so that for the components nothing changes;
// then it puts its own model in force by an ordinary swap. A component that is not back when it is
// time for that (it is stopped, or its user services the node late) comes back when it likes; until
// then its ports and names are kept for it, for as long as its process lives.
#include <sys/epoll.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>

#include "service/daemon.hpp"
#include "service/log/log.hpp"
#include "shm/clock.hpp"

namespace arbiter::service {
namespace {

// How long the predecessor's components may take to come back before others are served.
constexpr shm::Nanoseconds kMaxWaitForReturn = 500'000'000;
// The same where none of them has handed back its memory yet, though one lives. Later they must
// start anew.
constexpr shm::Nanoseconds kMaxWaitForRealm = 2'000'000'000;
// How many components that have ended the state file may name.
constexpr std::size_t kMaxForgotten = 64;
// About what it takes to remember one link that a component says it has.
constexpr std::uint64_t kBytesOfAClaim = 128;

shm::FileDescriptor open_process(pid_t pid) {
  return shm::FileDescriptor(static_cast<int>(syscall(SYS_pidfd_open, pid, 0)));
}

// Nobody's, where that cannot be told.
uid_t user_of_process(pid_t pid) {
  struct stat status {};
  if (::stat(("/proc/" + std::to_string(pid)).c_str(), &status) != 0) return uid_t(-1);
  return status.st_uid;
}

}  // namespace

void Daemon::look_for_predecessor() {
  started_ = shm::monotonic_now();
  predecessor_ = state_.read();
  const auto stored = stores_ ? take_stored() : std::vector<StoredDescriptor>();
  const auto find = [&](const char* name) {
    return std::find_if(stored.begin(), stored.end(),
                        [&](const StoredDescriptor& each) { return each.name == name; });
  };
  const auto board = find("board");
  const auto registry = find("registry");
  if (board != stored.end() && registry != stored.end()) {
    try {
      inherit(board->descriptor, registry->descriptor);
      for (const StoredDescriptor& each : stored) {
        if (&each == &*board || &each == &*registry) continue;
        if (!names_.take_page(each.descriptor)) discard_stored(each.name);
      }
      return;
    } catch (const std::exception& error) {
      log::warn("what the service manager has kept is of no use: {}", error.what());
    }
  }
  if (predecessor_ && predecessor_->is_survived) {
    phase_ = Phase::kExpecting;
  } else {
    finish_takeover();
  }
}

void Daemon::inherit(const shm::FileDescriptor& board, const shm::FileDescriptor& registry) {
  Registry inherited(registry);
  board_.inherit(board);
  registry_ = std::move(inherited);
  names_.restore(board_.in_force().generation);
  find_absentees();
  phase_ = Phase::kTakingOver;
  log::info("taking over from the last daemon, {} components and model {}", absentees_.size(),
            board_.in_force().generation);
}

void Daemon::find_absentees() {
  for (const auto& source : names_.sources()) {
    if (source->away != 0) add_absentee(registry_.source(source->id).owner());
  }
  for (const auto& input : names_.inputs()) {
    if (input->away != 0) add_absentee(registry_.input(input->id).owner());
  }
}

void Daemon::add_absentee(const Owner& owner) {
  Absentee& absentee = absentees_[owner.node];
  if (!absentee.process) {
    absentee.pid = owner.process.pid;
    absentee.user = user_of_process(owner.process.pid);
    absentee.process = open_process(owner.process.pid);
    if (!absentee.process || !owner.process.lives() || has_ended(absentee.process)) {
      absentees_.erase(owner.node);
      switchboard_.forget_away(owner.port);
      return;
    }
    watch(absentee.process.get(), Tag::kAbsentee, owner.node, EPOLLIN);
  }
  absentee.ports.insert(owner.port);
}

void Daemon::rejoin(Client& client, const shm::Received& hello) {
  if (phase_ == Phase::kExpecting) {
    if (!(Realm{FileIdentity::of(hello.descriptors[0]), FileIdentity::of(hello.descriptors[1])} ==
          predecessor_->realm)) {
      throw std::runtime_error("this daemon's predecessor had other memory");
    }
    inherit(hello.descriptors[0], hello.descriptors[1]);
  } else if (!(FileIdentity::of(hello.descriptors[0]) == FileIdentity::of(board_.readable()))) {
    throw std::runtime_error("this daemon does not know the ports of \"" + client.name +
                             "\", which another daemon has opened; restart the component");
  }
  const NodeId node = hello.message.link;
  // The conversation that it gave up may not have been seen to end.
  const auto former = std::find_if(clients_.begin(), clients_.end(), [&](const auto& each) {
    return each.second->node == node && each.second.get() != &client &&
           client.is_process(each.second->pid(), each.second->process());
  });
  if (former != clients_.end()) drop(former->first);
  const auto absentee = absentees_.find(node);
  if (absentee != absentees_.end() &&
      client.is_process(absentee->second.pid, absentee->second.process.get())) {
    client.node = node;
    client.to_hand_back = std::move(absentee->second.ports);
    absentees_.erase(absentee);
  }
  client.is_returning = true;
  client.is_component = true;
  welcome(client);
}

void Daemon::take_back_page(Client& client, const shm::Received& received) {
  const shm::SourceId id = received.message.id;
  const Source* source = names_.source_by_id(id);
  // One that was to come into force next when the last daemon ended.
  if (source != nullptr && received.message.value == source->page_number + 1) return;
  if (!names_.take_page(id, received.descriptors[0])) {
    throw std::runtime_error("what was handed back is not the page of source " +
                             std::to_string(id));
  }
  client.pages[id] = names_.source_by_id(id)->page_number;
}

void Daemon::take_back_output(Client& client, const shm::Received& received) {
  const shm::Message& message = received.message;
  Source* source = names_.source_by_id(message.id);
  if (source == nullptr || source->away != message.port ||
      client.to_hand_back.erase(message.port) == 0) {
    throw std::runtime_error("an output port that it never had was handed back");
  }
  names_.take_page(message.id, received.descriptors[1]);
  switchboard_.readmit(adopt_output(received, client.user()), client, *source);
}

void Daemon::take_back_input(Client& client, const shm::Received& received) {
  const shm::Message& message = received.message;
  InputName* input = names_.input_by_id(message.id);
  if (input == nullptr || input->away != message.port ||
      client.to_hand_back.erase(message.port) == 0) {
    throw std::runtime_error("an input port that it never had was handed back");
  }
  switchboard_.readmit(adopt_input(received, client.user()), client, *input);
}

void Daemon::take_back_link(const Client& client, const shm::Message& message) {
  if (!client.is_returning || client.ports.count(message.port) == 0) return;
  // It may claim links with ports that have never been, one after the other.
  Charge charge = shares_.take(client.user(), Share::kQueue, kBytesOfAClaim);
  switchboard_.claim(message.port, message.peer, {message.link, std::move(charge)});
}

void Daemon::finish_return(Client& client) {
  if (!client.is_returning) return;
  client.is_returning = false;
  for (const shm::PortInstance port : std::exchange(client.to_hand_back, {})) {
    switchboard_.forget_away(port);  // closed meanwhile
  }
  std::set<shm::PortInstance> away;
  for (const auto& source : names_.sources()) away.insert(source->away);
  for (const auto& input : names_.inputs()) away.insert(input->away);
  away.erase(0);
  const auto is_away = [&](shm::PortInstance port) { return away.contains(port); };
  for (const shm::PortInstance port : client.ports) switchboard_.settle_claims(port, is_away);
  const auto table = board_.in_force().table;
  switchboard_.link_all(table);
  switchboard_.unlink(table);
  try_postponed_ = true;
  log::info("{} is back, with {} ports", client.description(), client.ports.size());
}

void Daemon::set_away(Client& client) {
  if (client.ports.empty() && client.to_hand_back.empty()) return;
  Absentee& absentee = absentees_[client.node];
  absentee.pid = client.pid();
  absentee.user = client.user();
  absentee.ports = std::exchange(client.to_hand_back, {});
  absentee.ports.insert(client.ports.begin(), client.ports.end());
  while (!client.ports.empty()) switchboard_.set_away(*client.ports.begin());
  absentee.process = client.release_process();
  absentee.charge = std::move(client.charge);
  watch(absentee.process.get(), Tag::kAbsentee, client.node, EPOLLIN);
}

void Daemon::forget_absentee(NodeId node) {
  const auto found = absentees_.find(node);
  if (found == absentees_.end()) return;
  const Absentee absentee = std::move(found->second);
  absentees_.erase(found);
  for (const shm::PortInstance port : absentee.ports) switchboard_.forget_away(port);
  try_postponed_ = true;
  log::info("process {} has ended, {} ports with it", absentee.pid, absentee.ports.size());
}

// All who came in time are back. Our own model comes into force, and others are served.
void Daemon::finish_takeover() {
  const bool is_fresh = phase_ != Phase::kTakingOver;
  remember_components();
  if (is_fresh) {
    if (phase_ == Phase::kExpecting)
      log::warn("no component has handed back what the last daemon left");
    if (stores_) {
      discard_stored("board");
      discard_stored("registry");
      store("board", board_.writable());
      store("registry", registry_.writable());
    }
  }
  phase_ = Phase::kServing;
  try_postponed_ = true;
  names_.forget_lost_pages();
  const auto inherited = board_.in_force().generation;
  if (inherited != 0) {
    history_.add({inherited, 0, board_.name(), {}, calendar_ms(), "takeover", {}, {}, nullptr});
  }
  if (files_.empty()) {
    if (!is_fresh) log::info("no model was given: the one in force stays");
    switchboard_.link_all(board_.in_force().table);
    welcome_waiting();
    return;
  }
  try {
    Swap swap = first_swap();
    begin_swap(swap);
  } catch (const std::exception& error) {
    if (is_fresh) throw;
    log::error("the model in force stays: {}", error.what());
    welcome_waiting();
  }
}

// The model that the last daemon had in force, if this one has it by that name, too.
Daemon::Swap Daemon::first_swap() {
  Library library(std::exchange(read_at_start_, {}), names_);
  const std::string last = board_.name();
  const LoadedModel* next = library.find(last);
  if (next == nullptr) {
    next = library.first();
    if (!last.empty()) {
      log::warn(R"(the last daemon's model "{}" is not among those given: "{}" takes its place)",
                last, next->model->name);
    }
  }
  Swap swap;
  swap.to = *next;
  swap.how = "start";
  reserve_tables(library);
  swap.library = std::move(library);
  return swap;
}

// For the next daemon.
void Daemon::remember_components() {
  std::vector<Process> components;
  for (const auto& [id, client] : clients_) {
    if (client->is_component) components.push_back(client->identity());
  }
  for (const auto& [node, absentee] : absentees_) {
    components.push_back({absentee.pid, start_of_process(absentee.pid)});
  }
  state_.write({FileIdentity::of(board_.readable()), FileIdentity::of(registry_.readable())},
               components);
}

void Daemon::remember_component(Client& client) {
  if (std::exchange(client.is_component, true)) return;
  state_.add(client.identity());
  if (state_.size() > kMaxForgotten + 2 * (clients_.size() + absentees_.size())) {
    remember_components();
  }
}

void Daemon::welcome_waiting() {
  for (const ClientId id : std::exchange(waiting_, {})) {
    const auto client = clients_.find(id);
    if (client != clients_.end()) welcome(*client->second);
  }
}

shm::Nanoseconds Daemon::takeover_deadline() const {
  if (phase_ == Phase::kTakingOver) return started_ + kMaxWaitForReturn;
  if (phase_ == Phase::kExpecting && !waiting_.empty()) return started_ + kMaxWaitForRealm;
  return shm::kForever;
}

void Daemon::advance_takeover(shm::Nanoseconds now) {
  if (phase_ == Phase::kServing) return;
  const bool all_are_back = phase_ == Phase::kTakingOver && absentees_.empty() &&
                            std::none_of(clients_.begin(), clients_.end(), [](const auto& each) {
                              return each.second->is_returning;
                            });
  if (all_are_back || now >= takeover_deadline()) finish_takeover();
}

void Daemon::retry_postponed(shm::Nanoseconds now) {
  const bool all = std::exchange(try_postponed_, false);
  for (Postponed& request : std::exchange(postponed_, {})) {
    const auto found = clients_.find(request.client);
    if (found == clients_.end()) continue;
    if (all || now >= request.deadline) {
      Client& client = *found->second;
      client.to_retry.push_back(std::move(request));
      client.has_turn = true;
      turns_.add(client.user(), client.id());
      watch_client(client);
    } else {
      postponed_.push_back(std::move(request));
    }
  }
}

}  // namespace arbiter::service
