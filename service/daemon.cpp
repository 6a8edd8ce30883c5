#include "service/daemon.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "service/kept/step.hpp"
#include "service/log/event.hpp"
#include "service/log/log.hpp"
#include "service/log/log_sink.hpp"
#include "service/policy/headroom.hpp"
#include "service/policy/users.hpp"
#include "shm/assertion.hpp"
#include "shm/clock.hpp"
#include "shm/utf8.hpp"
#include "wire/errands.hpp"
#include "wire/hang_up.hpp"

namespace arbiter::service {
namespace {

// How many messages of one client are handled before it is the next one's turn.
constexpr int kMaxMessagesAtOnce = 64;
// And for how long at most, but for the last of them.
constexpr shm::Nanoseconds kMaxTurn = 1'000'000;
// How often the loop looks who has something to say before it serves those of whom it knows.
constexpr int kMaxRounds = 64;
// Of one whose process has ended: another process that has its socket could go on for ever.
constexpr int kMostLastTurns = 64;

std::uint64_t event_key(std::uint32_t tag, ClientId client) {
  return std::uint64_t{tag} << 56 | client;
}

}  // namespace

Daemon::Daemon(const DaemonOptions& options)
    : instance_(options.instance),
      gate_(options.policy),
      shares_(totals_of_this_process(), options.user_share, geteuid()),
      names_(registry_, shares_, options.uses_descriptor_store),
      takeover_({gate_, shares_, registry_, names_, board_, switchboard_, clients_}, *this,
                StateFile(options.directory, options.instance), options.uses_descriptor_store),
      changes_({options.instance, options.models, options.is_strict, options.steps,
                options.compiles_in, options.before_reading},
               {gate_, names_, board_, switchboard_, introductions_, clients_}, [this] {
                 takeover_.welcome_waiting();
                 try_postponed_ = true;
               }) {
  changes_.read_first(
      options.stop_descriptor, [&] { return handle_signal(options.stop_descriptor); },
      takeover_.may_inherit());
  listener_ = wire::listen_at(options.directory, instance_);
  if (fcntl(listener_.socket.get(), F_SETFL, O_NONBLOCK) != 0) {
    throw std::system_error(errno, std::generic_category(), "listening");
  }
  epoll_.reset(epoll_create1(EPOLL_CLOEXEC));
  if (!epoll_) throw std::system_error(errno, std::generic_category(), "epoll_create1");
  watch(listener_.socket.get(), Tag::kListener, 0, EPOLLIN);
  watch(changes_.descriptor(), Tag::kCompiler, 0, EPOLLIN);
  if (!Headroom::of_the_process().is_enough()) {
    log::warn("few descriptors (RLIMIT_NOFILE): a client that sends many can hold up this daemon");
  }
  takeover_.look_for_predecessor();
}

Daemon::~Daemon() {
  unlink(listener_.path.c_str());
  at_step("socket-removed");
  // Who has connected and was not accepted may have sent something, too.
  wire::Errands::of_the_process().close(geteuid(), std::move(listener_.socket));
  while (!lobby_.empty()) {
    for (Lobby::Waiting& each : lobby_.next()) {
      wire::Errands::of_the_process().close(each.user, std::move(each.socket));
    }
  }
  takeover_.leave_nothing_if_nobody_is_left();
  at_step("state-removed");
}

void Daemon::watch(int fd, Tag tag, ClientId client, std::uint32_t events) {
  epoll_event event{};
  event.events = events;
  event.data.u64 = event_key(static_cast<std::uint32_t>(tag), client);
  // Most are watched already.
  if (epoll_ctl(epoll_.get(), EPOLL_CTL_MOD, fd, &event) != 0 &&
      (errno != ENOENT || epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, fd, &event) != 0)) {
    throw std::system_error(errno, std::generic_category(), "epoll_ctl");
  }
}

void Daemon::unwatch(int fd) const noexcept { epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, fd, nullptr); }

int Daemon::timeout_ms() const {
  const bool may_change = takeover_.is_over() && changes_.can_advance();
  if (!turns_.empty() || !lobby_.empty() || is_more_to_tell_ || may_change ||
      !names_.closed().empty() || (try_postponed_ && !postponed_.empty()))
    return 0;
  shm::Nanoseconds deadline =
      std::min({barriers_.next_deadline(), takeover_.deadline(), introductions_.deadline(),
                give_back_at_, status_requests_.next(), listen_again_at_, look_in_flight_at_,
                watchdog_.deadline(), wire::Errands::of_the_process().deadline()});
  for (const Postponed& request : postponed_) deadline = std::min(deadline, request.deadline);
  if (deadline == shm::kForever) return -1;
  const shm::Nanoseconds left = std::max<shm::Nanoseconds>(deadline - shm::monotonic_now(), 0);
  return static_cast<int>(left / 1'000'000 + 1);
}

void Daemon::run(int signal_descriptor) {
  watch(signal_descriptor, Tag::kSignals, 0, EPOLLIN);
  for (;;) {
    if (!hear(signal_descriptor)) return;
    admit_clients();
    give_turns();
    const shm::Nanoseconds now = shm::monotonic_now();
    for (const ClientId late : barriers_.expire(now)) note_late(late, now);
    introductions_.advance(now);
    look_after_the_loop(now);
    takeover_.advance(now);
    retry_postponed(now);
    if (takeover_.is_over()) {
      changes_.advance();
      give_back_at_ = names_.give_back(now);
    }
    is_more_to_tell_ = observers_.tell(clients_, switchboard_, board_.in_force().generation);
    answer_status(now);
    settle();
    if (stop_wanted_) return;
  }
}

// Notes who has something to say, waiting for it if nothing is to be done. False: stop.
bool Daemon::hear(int signal_descriptor) {
  constexpr int kAtOnce = 64;
  epoll_event events[kAtOnce];
  int timeout = timeout_ms();
  for (int round = 0; round < kMaxRounds; ++round) {
    const int count = epoll_wait(epoll_.get(), events, kAtOnce, timeout);
    if (count < 0 && errno != EINTR) {
      throw std::system_error(errno, std::generic_category(), "epoll_wait");
    }
    for (int i = 0; i < count; ++i) {
      const auto tag = static_cast<Tag>(events[i].data.u64 >> 56);
      const ClientId id = events[i].data.u64 & ((std::uint64_t{1} << 56) - 1);
      if (tag == Tag::kListener) accept_clients();
      if (tag == Tag::kCompiler) changes_.finish_preparing();
      if (tag == Tag::kSignals && handle_signal(signal_descriptor)) return false;
      if (tag == Tag::kAbsentee) takeover_.forget_absentee(id);
      if (tag == Tag::kClient) hear_client(id, events[i].events);
      if (tag == Tag::kProcess) hear_death(id);
    }
    if (count < kAtOnce) break;
    timeout = 0;  // the others that have something to say, before anyone is served
  }
  return true;
}

void Daemon::hear_client(ClientId id, std::uint32_t events) {
  Client* const found = clients_.find(id);
  if (found == nullptr) return;
  Client& client = *found;
  if ((events & EPOLLOUT) != 0) client.flush();
  if ((events & ~EPOLLOUT) != 0) client.has_turn = true;
  if (client.has_turn) turns_.add(client.user(), id);
  watch_heard(client);
}

// It is given up in a turn of its user's, lest the end of a process that had a thousand nodes keep
// the others waiting. What it sent before it died is served first: it may have ended in order.
void Daemon::hear_death(ClientId id) {
  Client* const found = clients_.find(id);
  if (found == nullptr) return;
  Client& client = *found;
  unwatch(client.process());
  client.has_turn = client.is_last_turn = true;
  turns_.add(client.user(), id);
  watch_client(client);
}

// One turn for each user who waits for one.
void Daemon::give_turns() {
  for (std::size_t left = turns_.users(); left > 0; --left) {
    const auto id = turns_.next();
    if (!id) return;
    Client* const found = clients_.find(*id);
    if (found == nullptr) continue;
    Client& client = *found;
    const bool has_more = serve(client);
    if (clients_.find(*id) == nullptr) continue;
    const bool is_over = client.is_last_turn && ++client.last_turns == kMostLastTurns;
    if (is_over || (!has_more && (client.is_last_turn || client.is_lost()))) {
      drop(*id);
      continue;
    }
    client.has_turn = has_more;
    if (has_more) turns_.add(client.user(), *id);
    watch_client(client);
  }
}

// One that waits for its turn is not heard again before it, and whoever is heard is not until this.
void Daemon::watch_client(Client& client) {
  const std::uint32_t in = client.has_turn ? 0u : static_cast<std::uint32_t>(EPOLLIN | EPOLLRDHUP);
  client.watches_queue = client.can_be_sent_more();
  const std::uint32_t out = client.watches_queue ? static_cast<std::uint32_t>(EPOLLOUT) : 0u;
  watch(client.socket(), Tag::kClient, client.id(), in | out | EPOLLONESHOT);
}

// Who has hung up is heard whatever is asked for: while he waits for his turn, nothing is. Or a
// thousand who have hung up at once would be heard again and again before one of them is served.
void Daemon::watch_heard(Client& client) {
  client.watches_queue = false;
  if (!client.has_turn || client.can_be_sent_more()) watch_client(client);
}

bool Daemon::handle_signal(int signal_descriptor) {
  signalfd_siginfo info{};
  while (::read(signal_descriptor, &info, sizeof info) == static_cast<ssize_t>(sizeof info)) {
    if (info.ssi_signo == SIGHUP) {
      changes_.reload_for_signal("a signal of process " + std::to_string(info.ssi_pid) + ", user " +
                                 describe_user(info.ssi_uid));
      continue;
    }
    log_event({EventKind::kStopping}, log::level::info, "stopping: signal {}", info.ssi_signo);
    return true;
  }
  return false;
}

void Daemon::look_after_the_loop(shm::Nanoseconds now) {
  watchdog_.go_round(now);
  if (now >= listen_again_at_) {
    listen_again_at_ = shm::kForever;
    watch(listener_.socket.get(), Tag::kListener, 0, EPOLLIN);
  }
  look_in_flight(now);
  names_.closed().give_up(shm::monotonic_now() + kMaxTurn);
  const std::string lost = wire::Errands::of_the_process().look_after(now);
  if (!lost.empty()) log::warn("{}", lost);
}

bool Daemon::serve(Client& client) {
  const LogAccount account(client.user());
  const ClientId id = client.id();
  const uid_t user = client.user();
  const shm::Nanoseconds until = shm::monotonic_now() + kMaxTurn;
  wire::Received received;
  for (int i = 0; i < kMaxMessagesAtOnce; ++i) {
    if (!client.to_retry.empty()) {
      retry(client);
      if (clients_.find(id) == nullptr) return false;
      if (shm::monotonic_now() >= until) break;
      continue;
    }
    switch (client.receive(received)) {
      case wire::ReceiveResult::kNothing:
        return false;
      case wire::ReceiveResult::kReceived:
        break;
      case wire::ReceiveResult::kMalformed:
        log_event({EventKind::kGivenUp, {client.name}}, log::level::warn,
                  "{} sent something that is not a message; dropped", client.description());
        wire::dispose_of(received, user);
        drop(id);
        return false;
      case wire::ReceiveResult::kClosed:
        wire::dispose_of(received, user);
        drop(id);
        return false;
    }
    handle_or_refuse(client, received, shm::kForever);
    wire::dispose_of(received, user);
    if (clients_.find(id) == nullptr) return false;
    if (shm::monotonic_now() >= until) break;
  }
  return true;
}

void Daemon::retry(Client& client) {
  Postponed request = std::move(client.to_retry.front());
  client.to_retry.pop_front();
  ARBITER_ASSERT(client.postponed != 0, "a request is tried again that was not postponed");
  --client.postponed;
  request.request.give_back();  // or a user who has room for one could not have it wait on
  handle_or_refuse(client, request.request.received(), request.deadline);
}

// What it is about, as far as the request says: only a name that has passed for one is a name.
void Daemon::log_refusal(const Client& client, const wire::Message& request,
                         const std::string& why) {
  Event event{EventKind::kRefused, {client.name}};
  const std::string name(request.name_view());
  const bool is_port = shm::is_port_name(name);
  const auto is = [&](wire::MessageKind kind) { return is_port && request.kind == kind; };
  bool is_news = true;
  if (is(wire::MessageKind::kOpenInput)) {
    event.ports = {name};
    is_news = refusals_.note(client, Refusals::End::kInput, name, why, shm::monotonic_now());
  }
  if (is(wire::MessageKind::kOpenOutput)) {
    event.sources = {name};
    is_news = refusals_.note(client, Refusals::End::kOutput, name, why, shm::monotonic_now());
  }
  if (is(wire::MessageKind::kDeactivate)) event.sources = {name};
  if (is_news) log_event(event, log::level::warn, "{}: {}", client.description(), why);
}

// `deadline`: of a request that was postponed.
void Daemon::handle_or_refuse(Client& client, wire::Received& received, shm::Nanoseconds deadline) {
  const LogAccount account(client.user());
  std::string why;
  bool is_ours = received.lost_descriptors;
  try {
    handle(client, received);
    return;
  } catch (const NotYet& not_yet) {
    why = not_yet.what();
    deadline = std::min(deadline, not_yet.deadline);
    if (client.postponed == shm::kMaxPostponed) {
      why = "limit-exceeded: " + std::to_string(shm::kMaxPostponed) +
            " requests of this client wait already (kMaxPostponed): " + why;
    } else if (shm::monotonic_now() < deadline) {
      try {
        postponed_.push_back({client.id(), client.put_aside(received), deadline});
        ++client.postponed;
        return;
      } catch (const LimitExceeded& limit) {
        why = std::string(limit.what()) + "; it would have to wait: " + why;
      }
    }
  } catch (const RefusedAgain& again) {  // every second: one line for each component is enough
    refuse(client, received.message.request, again.what());
    return;
  } catch (const std::exception& error) {
    why = error.what();
    // For want of a share; or of a descriptor, or memory, to keep it by.
    is_ours = is_ours || dynamic_cast<const LimitExceeded*>(&error) != nullptr ||
              dynamic_cast<const std::system_error*>(&error) != nullptr;
  }
  if (Takeover::note_refusal(client, received.message, why, is_ours)) {
    log_refusal(client, received.message, why);
  }
  refuse(client, received.message.request, why);
}

void Daemon::retry_postponed(shm::Nanoseconds now) {
  const bool all = std::exchange(try_postponed_, false);
  for (Postponed& request : std::exchange(postponed_, {})) {
    Client* const found = clients_.find(request.client);
    if (found == nullptr) continue;
    if (all || now >= request.deadline) {
      Client& client = *found;
      client.to_retry.push_back(std::move(request));
      client.has_turn = true;
      turns_.add(client.user(), client.id());
      watch_client(client);
    } else {
      postponed_.push_back(std::move(request));
    }
  }
}

// After each round: sends what is queued, and drops who is lost.
void Daemon::settle() {
  std::vector<ClientId> lost;
  for (const auto& [id, client] : clients_) {
    // One that has hung up may have closed its ports before: it is read to its end, and then gone.
    if (client->is_lost() && !client->has_hung_up()) {
      lost.push_back(id);
      continue;
    }
    if ((client->has_read_ahead() || client->is_lost()) && !client->has_turn) {
      client->has_turn = true;
      turns_.add(client->user(), id);
    }
    if (client->can_be_sent_more() && !client->watches_queue) watch_client(*client);
  }
  for (const ClientId id : lost) drop(id);
  // Another round: others are told of it, who may be slow to read, or lost for it.
  if (!lost.empty()) is_more_to_tell_ = true;
  plan_to_look_in_flight();
}

void Daemon::watch_absentee(const shm::FileDescriptor& process, NodeId node) {
  watch(process.get(), Tag::kAbsentee, node, EPOLLIN);
}

}  // namespace arbiter::service
