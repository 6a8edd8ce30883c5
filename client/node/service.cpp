// What the daemon says, and the thread that hears it.
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <system_error>
#include <utility>

#include "client/node/node_core.hpp"
#include "shm/clock.hpp"

namespace arbiter::detail {
namespace {

// How much less than a normal thread the service thread presses for the processor.
constexpr int kServiceNiceness = 5;
// While a publisher that is gone has samples waiting: how often it is looked whether those of its
// successor have pushed them out. The successor rings nobody for that. The same for taps that no
// daemon knows: whether their programs live.
constexpr int kTidyInterval = 1000;  // ms
// How often it is tried to say what the user has too many descriptors under way for.
constexpr int kSayAgainInterval = 50;  // ms

}  // namespace

// Of low priority whatever its maker's is: a real-time component must not be disturbed by it. A new
// thread has its maker's policy and processors. It is not left to change them itself: beside a
// maker of SCHED_FIFO that spins from now on it would never come to it.
void NodeCore::start_service_thread() {
  service_thread_ = std::thread([this] { run_service_thread(); });
  const pthread_t thread = service_thread_.native_handle();
  const sched_param normal{};
  pthread_setschedparam(thread, SCHED_OTHER, &normal);
  if (options_.service_cpus.empty()) return;
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  for (const unsigned cpu : options_.service_cpus) {
    if (cpu < CPU_SETSIZE) CPU_SET(cpu, &cpus);
  }
  if (const int error = pthread_setaffinity_np(thread, sizeof cpus, &cpus); error != 0) {
    stop_service_thread();
    throw Error(std::string("service_cpus: no thread can run there: ") + std::strerror(error));
  }
}

void NodeCore::stop_service_thread() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  if (!service_thread_.joinable()) return;
  service_bell_->ring();
  // The last port may go on the service thread itself, if that was the last to use it.
  if (service_thread_.get_id() == std::this_thread::get_id()) {
    service_thread_.detach();
  } else {
    service_thread_.join();
  }
}

void NodeCore::run_service_thread() {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
  pthread_setname_np(pthread_self(), "arbiter-service");
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kServiceNiceness);
  for (;;) {
    int time = 0;
    {
      const std::lock_guard lock(mutex_);
      if (stopping_) return;
      time = look_again_in();
    }
    pump(time);
    give_notices();
  }
}

int NodeCore::look_again_in() const noexcept {
  const bool has_to_tidy =
      has_ended_to_tell_ || !missed_pages_.empty() ||
      std::any_of(inputs_.begin(), inputs_.end(),
                  [](const auto& input) { return input.second->has_predecessors(); }) ||
      std::any_of(outputs_.begin(), outputs_.end(),
                  [](const auto& output) { return output.second->has_doubtful_taps(); });
  const int tidy = has_too_many() ? kSayAgainInterval : has_to_tidy ? kTidyInterval : -1;
  const shm::Nanoseconds due = next_description();
  if (due == shm::kForever) return tidy;
  const shm::Nanoseconds left = std::max<shm::Nanoseconds>(0, due - shm::monotonic_now());
  const int description = static_cast<int>(left / 1'000'000) + 1;
  return tidy < 0 ? description : std::min(tidy, description);
}

// Whoever waits for service_fd() does not know when that is. A ring that has come is taken back by
// this. Alone, the timer has its own time.
void NodeCore::ring_when_to_look_again() const {
  if (socket_ != nullptr) {
    ring_timer_every(std::chrono::milliseconds(std::max(0, look_again_in())));
  }
}

// Where there is a service thread, it does this.
void NodeCore::service() {
  if (service_thread_.joinable()) return;
  const auto pump_once = [this] {
    const std::lock_guard pumping(pump_mutex_);
    pump(0);
  };
  do {
    pump_once();
  } while (give_notices());
}

void NodeCore::pump(int timeout_ms) {
  epoll_event event{};
  static_cast<void>(epoll_wait(epoll_.get(), &event, 1, timeout_ms));
  tidy();
  Socket socket;
  {
    const std::lock_guard lock(mutex_);
    say_what_waits();
    say_who_has_ended(Whom::kOwn);
    say_descriptions();
    if (!options_.service_thread) ring_when_to_look_again();
    socket = socket_;
    if (socket != nullptr && !hears()) return;
  }
  if (socket == nullptr) {
    std::uint64_t rings = 0;
    if (::read(timer_.get(), &rings, sizeof rings) > 0) rejoin();
    return;
  }
  wire::Received received;
  for (;;) {
    switch (wire::receive_message(socket->get(), received, false)) {
      case wire::ReceiveResult::kReceived:
        handle(received);
        break;
      case wire::ReceiveResult::kNothing:
        return;
      case wire::ReceiveResult::kClosed:
      case wire::ReceiveResult::kMalformed: {
        const std::lock_guard lock(mutex_);
        if (socket_ == socket) lose_daemon();
        return;
      }
    }
    const std::lock_guard lock(mutex_);
    if (socket_ != socket || !hears() || has_notices()) return;
  }
}

void NodeCore::tidy() {
  std::vector<std::pair<shm::PortInstance, std::shared_ptr<const OutputPeer>>> to_look_at;
  tidy_ports(to_look_at);
  for (const auto& [port, peer] : to_look_at) look_at_growth(port, *peer);
  try_missed_pages();
}

void NodeCore::tidy_ports(
    std::vector<std::pair<shm::PortInstance, std::shared_ptr<const OutputPeer>>>& copied_from) {
  const std::lock_guard lock(mutex_);
  service_bell_->silence();
  for (auto& [instance, output] : outputs_) {
    output->tidy();
    for (const shm::PortInstance peer : output->misbehaving()) {
      say_refused(
          instance, peer,
          "the input port misbehaves: it says that it has read samples that were never published");
    }
    for (const auto& [peer, why] : output->short_of_memory()) refuse_waiting(instance, *peer, why);
    if (output->has_become_blind()) say_blind(instance, "discards its samples");
  }
  for (auto& [instance, input] : inputs_) {
    input->tidy();
    for (const shm::PortInstance peer : input->misbehaving()) {
      say_refused(
          instance, peer,
          "the output port misbehaves: its queue has an entry that no honest publisher writes");
    }
    if (input->has_become_blind()) say_blind(instance, "delivers nothing");
    for (auto& peer : input->copied_from()) copied_from.emplace_back(instance, std::move(peer));
  }
  tidy_taps(copied_from);
}

// This process has no descriptor left for what came with a message. Nothing is lost by that but
// what the message was about; of a page, not even that.
void NodeCore::handle_without_descriptors(const wire::Message& message) {
  const std::string why = wire::no_descriptor_left("what the daemon sends");
  switch (message.kind) {
    case wire::MessageKind::kWelcome: {
      const std::lock_guard lock(mutex_);
      put_off(why);
      return;
    }
    case wire::MessageKind::kOutputPeer:
    case wire::MessageKind::kInputPeer:
      refuse_peer(message, why);
      return;
    case wire::MessageKind::kTap:
    case wire::MessageKind::kTapSource:
    case wire::MessageKind::kTapInput:
      refuse_tap(message, why);
      return;
    case wire::MessageKind::kSourcePage:
      // The daemon takes it for shown: it shows it again to a node that comes back.
      note_missed(std::string(message.name_view()), why);
      break;
    default:
      break;
  }
  const std::lock_guard lock(mutex_);
  if (message.kind == wire::MessageKind::kSourcePage) return put_off(why);
  const bool is_opened = message.kind == wire::MessageKind::kOpened;
  if (is_opened) say_closed(message.port);  // what it is answered ends the wait
  const auto found = replies_.find(message.request);
  if (found == replies_.end()) {
    given_up_.erase(message.request);
    return;
  }
  found->second.refusal = why;
  found->second.finished = !is_opened;
  news_.notify_all();
}

void NodeCore::handle(wire::Received& received) {
  const wire::Message& message = received.message;
  if (received.lost_descriptors) {
    handle_without_descriptors(message);
    return;
  }
  switch (message.kind) {
    case wire::MessageKind::kWelcome:
      be_welcomed(received);
      break;
    case wire::MessageKind::kSourcePage:
      add_page(received);
      break;
    case wire::MessageKind::kOutputGrown:
      hear_of_growth(message);
      break;
    case wire::MessageKind::kPeerGone:
    case wire::MessageKind::kDisconnected:
      end_peer(message);
      break;
    case wire::MessageKind::kInputPeer:
    case wire::MessageKind::kOutputPeer:
      try {
        message.kind == wire::MessageKind::kInputPeer ? add_receiver(received)
                                                      : add_publisher(received);
      } catch (const std::system_error& error) {
        refuse_peer(message, error.what());
        if (options_.lock_memory) say_not_locked(message.port, error.what());
      } catch (const std::exception& error) {
        refuse_peer(message, error.what());
      }
      break;
    case wire::MessageKind::kTap:
    case wire::MessageKind::kTapAway:
    case wire::MessageKind::kTapSource:
    case wire::MessageKind::kTapInput:
      handle_about_tap(received);
      break;
    case wire::MessageKind::kMeasure:
      set_measured(message);
      break;
    case wire::MessageKind::kConnectionRefused:
      handle_refusal(message);
      break;
    case wire::MessageKind::kUnmentioned:
      handle_unmentioned(message);
      break;
    case wire::MessageKind::kYield:
      handle_yield(message);
      break;
    case wire::MessageKind::kSync: {
      make_tables_resident();
      wire::Message synced;
      synced.kind = wire::MessageKind::kSynced;
      synced.request = message.request;
      const std::lock_guard lock(mutex_);
      say(synced);
      break;
    }
    case wire::MessageKind::kOpened:
      make_tables_resident();
      handle_reply(received);
      break;
    default:
      handle_reply(received);
      break;
  }
}

// Memory that came with the opening of a port makes the opening fail. What comes later is used as
// it is: a node that runs must not go blind for a limit. `port`: whose it is; 0: the node's.
void NodeCore::say_not_locked(shm::PortInstance port, const std::string& why) {
  const std::lock_guard lock(mutex_);
  bool is_told = false;
  for (auto& [request, reply] : replies_) {
    if (reply.opened == 0 || (port != 0 && reply.opened != port)) continue;
    reply.refusal = why;
    is_told = true;
  }
  if (!is_told) note(NoticeKind::not_locked, port, {}, why);
}

void NodeCore::handle_reply(wire::Received& received) {
  const wire::Message& message = received.message;
  const std::lock_guard lock(mutex_);
  if (message.kind == wire::MessageKind::kRefused && standing_ == Standing::kRejoining) {
    be_turned_away(message);
    return;
  }
  if (handle_tap_reopened(message)) return;
  const auto found = replies_.find(message.request);
  if (found == replies_.end()) {
    // Nobody waits for it any more.
    given_up_.erase(message.request);
    if (message.kind == wire::MessageKind::kOpened) say_closed(message.port);
    return;
  }
  Reply& reply = found->second;
  if (message.kind == wire::MessageKind::kOpened) {
    try {
      if (reply.on_opened) reply.on_opened(received);
      reply.opened = message.port;
    } catch (const std::exception& error) {
      reply.refusal = error.what();
      say_closed(message.port);
    }
    return;
  }
  if (message.kind == wire::MessageKind::kRefused) {
    // Perhaps for a port of ours that an opening before it has got and is to be closed.
    if (std::exchange(reply.is_behind_given_up, false)) {
      reply.has_asked_again = true;
      reply.asked_in = 0;
      news_.notify_all();
      return;
    }
    reply.refusal = message.text_view();
  }
  reply.received = std::move(received);
  reply.finished = true;
  const auto tap = taps_.find(reply.opened);
  if (tap != taps_.end() && reply.refusal.empty()) tap->second->is_open = true;
  news_.notify_all();
}

}  // namespace arbiter::detail
