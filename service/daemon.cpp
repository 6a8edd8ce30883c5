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
#include <utility>

#include "service/log.hpp"
#include "shm/clock.hpp"

namespace arbiter::service {
namespace {

// How many messages of one client are handled before it is the next one's turn.
constexpr int kMaxMessagesAtOnce = 64;

std::uint64_t event_key(std::uint32_t tag, ClientId client) {
  return std::uint64_t{tag} << 56 | client;
}

}  // namespace

Daemon::Daemon(const DaemonOptions& options)
    : instance_(options.instance),
      stores_(options.uses_descriptor_store),
      gate_(options.policy),
      files_(options.models),
      state_(options.directory, options.instance),
      proving_{options.steps, tell_service_manager()},
      before_reading_(options.before_reading),
      compiler_(options.compiles_in) {
  if (!files_.empty() || gate_.has_file()) read_first_models(options.stop_descriptor);
  listener_ = shm::listen_at(options.directory, instance_);
  epoll_.reset(epoll_create1(EPOLL_CLOEXEC));
  if (!epoll_) throw std::system_error(errno, std::generic_category(), "epoll_create1");
  watch(listener_.socket.get(), Tag::kListener, 0, EPOLLIN);
  watch(compiler_.descriptor(), Tag::kCompiler, 0, EPOLLIN);
  reserve_.reset(open("/dev/null", O_RDONLY | O_CLOEXEC));
  look_for_predecessor();
}

// Components that live on need the state file to come back by, as what the service manager keeps
// does.
Daemon::~Daemon() {
  unlink(listener_.path.c_str());
  if (!stores_ && phase_ == Phase::kServing && clients_.empty() && absentees_.empty())
    state_.remove();
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
  const bool may_change = !swap_ && !preparing_ && phase_ == Phase::kServing && !changes_.empty();
  if (is_behind || may_change || (try_postponed_ && !postponed_.empty())) return 0;
  shm::Nanoseconds deadline =
      std::min({barriers_.next_deadline(), takeover_deadline(), show_growth_at_});
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
      if (tag == Tag::kCompiler) finish_preparing();
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
    if (now >= show_growth_at_) {
      switchboard_.show_growth();
      show_growth_at_ = switchboard_.has_growth_to_show() ? now + kShowGrowthAfter : shm::kForever;
    }
    advance_takeover(now);
    serve_postponed(now);
    advance_changes();
    settle();
    if (stop_wanted_) return;
  }
}

bool Daemon::handle_signal(int signal_descriptor) {
  signalfd_siginfo info{};
  while (::read(signal_descriptor, &info, sizeof info) == static_cast<ssize_t>(sizeof info)) {
    if (info.ssi_signo == SIGHUP) {
      reload_for_signal("a signal of process " + std::to_string(info.ssi_pid) + ", user " +
                        describe_user(info.ssi_uid));
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
  std::string why;
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
      ++client.postponed;
      auto postponed = std::make_unique<shm::Received>(std::move(received));
      postponed_.push_back({client.id(), std::move(postponed), deadline});
      return;
    }
  } catch (const RefusedAgain& again) {  // every second: one line for each component is enough
    refuse(client, received.message.request, again.what());
    return;
  } catch (const std::exception& error) {
    why = error.what();
  }
  log::warn("{}: {}", client.description(), why);
  refuse(client, received.message.request, why);
}

void Daemon::drop(ClientId id) {
  const auto found = clients_.find(id);
  if (found == clients_.end()) return;
  const std::unique_ptr<Client> client = std::move(found->second);
  clients_.erase(found);
  if (!client->name.empty() && !client->is_turned_away) {
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
}

}  // namespace arbiter::service
