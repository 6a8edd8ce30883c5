// Who connects, who is turned away, who leaves, and whose unread messages are waited for.
#include <sys/epoll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <map>
#include <memory>
#include <utility>

#include "service/daemon.hpp"
#include "service/log/event.hpp"
#include "service/log/log.hpp"
#include "service/log/log_sink.hpp"
#include "service/policy/headroom.hpp"
#include "shm/clock.hpp"
#include "wire/errands.hpp"
#include "wire/hang_up.hpp"

namespace arbiter::service {
namespace {

// Without a descriptor, or memory, to accept a client with.
constexpr shm::Nanoseconds kListenAgainAfter = 100'000'000;

// How often it is looked who has read what he was sent, where somebody waits for that.
constexpr shm::Nanoseconds kLookInFlightAfter = 5'000'000;
// Each look in vain doubles that, so often: who never reads costs next to nothing.
constexpr unsigned kMostDoublings = 5;
// The same where nobody does, but what was left unread still counts.
constexpr shm::Nanoseconds kLookLeftUnreadAfter = 1'000'000'000;
// How often the log has it that a client is late.
constexpr shm::Nanoseconds kTellLateEvery = 60'000'000'000;

// How many connections are taken out of the kernel's queue in one round.
constexpr int kMaxAcceptedAtOnce = 64;

// Of who has connected; nobody in particular where that cannot be told.
uid_t user_of(const shm::FileDescriptor& socket) {
  ucred peer{};
  peer.uid = LogAccount::kUnknown;
  socklen_t size = sizeof peer;
  static_cast<void>(getsockopt(socket.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size));
  return peer.uid;
}

// An errand costs the loop least. But errands of a user who is stuck are not done: each socket
// would keep a descriptor that is charged to nobody.
void turn_away(shm::FileDescriptor socket, uid_t user) {
  wire::Errands& errands = wire::Errands::of_the_process();
  if (errands.is_stuck(user)) {
    wire::hang_up(std::move(socket), user);
  } else {
    ::shutdown(socket.get(), SHUT_RDWR);  // the thread that closes it may be lost
    errands.close(user, std::move(socket));
  }
}

}  // namespace

// What waits at the listener's, as far as it goes in one round.
void Daemon::accept_clients() {
  for (int i = 0; i < kMaxAcceptedAtOnce; ++i) {
    shm::FileDescriptor socket(
        accept4(listener_.socket.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!socket) {
      if (errno == EMFILE || errno == ENFILE) {
        turn_away_client();
      } else if (errno != EAGAIN && errno != ECONNABORTED && errno != EINTR) {
        if (!std::exchange(cannot_accept_, true)) {
          log::warn("no client can be accepted, which is tried again until one can: {}",
                    std::strerror(errno));
        }
        leave_listener_alone();
      }
      return;
    }
    cannot_accept_ = false;
    const uid_t user = user_of(socket);
    const LogAccount account(user);
    try {
      Charge descriptor = shares_.take(user, Share::kDescriptors);
      lobby_.add({user, std::move(socket), std::move(descriptor)});
    } catch (const LimitExceeded& limit) {  // anybody may come again and again: not worth a warning
      log_event({EventKind::kTurnedAway}, log::level::debug, "a client was turned away: {}",
                limit.what());
      turn_away(std::move(socket), user);
    }
  }
}

// One of each user's.
void Daemon::admit_clients() {
  for (Lobby::Waiting& waiting : lobby_.next()) {
    const LogAccount account(waiting.user);
    std::unique_ptr<Client> client;
    try {
      const ClientId id = ++last_client_;
      waiting.descriptor = {};
      client = std::make_unique<Client>(id, std::move(waiting.socket), shares_);
      watch_client(*client);
      if (client->process() >= 0) watch(client->process(), Tag::kProcess, id, EPOLLIN);
      clients_.add(std::move(client));
      drop_oldest_silent_client();
    } catch (const LimitExceeded& limit) {
      log_event({EventKind::kTurnedAway}, log::level::debug, "a client was turned away: {}",
                limit.what());
    } catch (const std::exception& error) {
      log_event({EventKind::kTurnedAway}, log::level::warn, "a client was turned away: {}",
                error.what());
      if (client != nullptr) unwatch(client->socket());
    }
  }
}

// Whoever ends in good order has closed its ports before.
void Daemon::log_end_of(const Client& client, bool is_away) {
  Event event{EventKind::kLeft, {client.name}};
  if (!client.ports.empty()) event.kind = is_away ? EventKind::kAway : EventKind::kDied;
  for (const shm::PortInstance port : client.ports) {
    if (const OutputPort* const output = switchboard_.output(port)) {
      event.sources.push_back(output->source->name);
    } else if (const InputPort* const input = switchboard_.input(port)) {
      event.ports.push_back(input->name->name);
    }
  }
  if (event.kind == EventKind::kDied) {
    takeover_.deaths().note(event, client.pid(), client.user());
  }
  if (client.ports.empty()) {
    // A tool's call is no event that an operator waits for; a monitor makes thousands.
    log_event(event, client.is_component ? log::level::info : log::level::debug, "{} left",
              client.description());
    return;
  }
  const bool is_dying = client.is_dying();
  if (event.kind == EventKind::kDied) {
    log_event(event, log::level::warn, "{} {} with {} open", client.description(),
              is_dying ? "died" : "is gone", ports_text(event));
  } else if (!is_dying) {  // else its death follows (Takeover::forget_absentee)
    const bool is_one = client.ports.size() == 1;
    log_event(event, log::level::info, "{} is away; its {}{} {} kept for it", client.description(),
              is_one ? "port " : "", ports_text(event), is_one ? "is" : "are");
  }
}

void Daemon::drop(ClientId id) {
  const std::unique_ptr<Client> client = clients_.take_out(id);
  if (client == nullptr) return;
  const LogAccount account(client->user());
  unwatch(client->socket());  // it is closed later
  // One that could not be known again does not come back as what it was.
  const bool can_be_known = client->is_process(client->pid(), client->process());
  const bool is_away = client->comes_back && can_be_known && !client->has_died();
  if (!client->name.empty() && !client->is_turned_away) log_end_of(*client, is_away);
  switchboard_.lose_taps(*client, is_away);
  if (is_away) takeover_.set_away(*client);
  while (!client->ports.empty()) remove_port(*client->ports.begin());
  switchboard_.forget_away(client->to_hand_back);
  observers_.forget(id);
  barriers_.forget(id);
  left_unread_.add(client->release_unread());
}

// It finds nothing of who has opened a port meanwhile. Whoever is stopped is late again and again;
// who waits for its turn may have answered.
void Daemon::note_late(ClientId id, shm::Nanoseconds now) {
  Client* const client = clients_.find(id);
  if (client == nullptr || client->has_turn) return;
  if (client->late_told_at != 0 && now - client->late_told_at < kTellLateEvery) return;
  client->late_told_at = now;
  const LogAccount account(client->user());
  log::warn(
      "{} has not answered for 0.2 s, and is not waited for: it is stopped, or its service "
      "thread has not run; until it does, it gets nothing of ports that open",
      client->description());
}

void Daemon::look_in_flight(shm::Nanoseconds now) {
  if (now < look_in_flight_at_) return;
  look_in_flight_at_ = shm::kForever;
  left_unread_.look();
  for (const auto& [id, client] : clients_) client->look_in_flight();
  for (const auto& [id, client] : clients_) {
    if (client->is_held_back()) client->flush();
  }
}

// At the end of a round: whoever is held back by now waits for that.
void Daemon::plan_to_look_in_flight() {
  shm::Nanoseconds after = left_unread_.empty() ? shm::kForever : kLookLeftUnreadAfter;
  for (const auto& [id, client] : clients_) {
    if (!client->is_held_back()) continue;
    after =
        std::min(after, kLookInFlightAfter << std::min(client->flushed_in_vain(), kMostDoublings));
  }
  if (after == shm::kForever) return;
  look_in_flight_at_ = std::min(look_in_flight_at_, shm::monotonic_now() + after);
}

// Who waits in its queue is heard then.
void Daemon::leave_listener_alone() {
  listen_again_at_ = shm::monotonic_now() + kListenAgainAfter;
  watch(listener_.socket.get(), Tag::kListener, 0, 0);
}

// It would stay in the listener's queue, and the loop would never rest. Where there is not even a
// descriptor for that, the listener is left alone for a while.
void Daemon::turn_away_client() {
  shm::FileDescriptor socket;
  {
    const Headroom::Use use;
    socket.reset(accept4(listener_.socket.get(), nullptr, nullptr, SOCK_CLOEXEC));
  }
  if (!socket) {
    leave_listener_alone();
    return;
  }
  const uid_t user = user_of(socket);
  const LogAccount account(user);
  log_event({EventKind::kTurnedAway}, log::level::warn,
            "a client of user {} was turned away: no descriptors are left (RLIMIT_NOFILE, "
            "LimitNOFILE= in a systemd unit)",
            user);
  wire::hang_up(std::move(socket), user);
}

// Whoever connects and says nothing costs two descriptors, and gives way to those who come later:
// of the user who has the most of them.
void Daemon::drop_oldest_silent_client() {
  std::map<uid_t, std::pair<std::size_t, ClientId>> silent;  // how many, and the oldest
  std::size_t count = 0;
  for (const auto& [id, client] : clients_) {
    if (!client->name.empty()) continue;
    ++count;
    ++silent.try_emplace(client->user(), std::size_t{0}, id).first->second.first;
  }
  if (count <= shm::kMaxSilentClients) return;
  const auto most = std::max_element(
      silent.begin(), silent.end(),
      [](const auto& one, const auto& other) { return one.second.first < other.second.first; });
  drop(most->second.second);
}

}  // namespace arbiter::service
