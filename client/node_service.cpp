// What the daemon says, and the thread that hears it.
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "client/node_core.hpp"

namespace arbiter::detail {
namespace {

// How much less than a normal thread the service thread presses for the processor.
constexpr int kServiceNiceness = 5;

}  // namespace

// Of low priority whatever its maker's is: a real-time component must not be disturbed by it.
void NodeCore::run_service_thread() {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
  pthread_setname_np(pthread_self(), "arbiter-service");
  const sched_param normal{};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &normal);
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kServiceNiceness);
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (stopping_) return;
    }
    pump(-1);
  }
}

// Where there is a service thread, it does this.
void NodeCore::service() {
  if (service_thread_.joinable()) return;
  const std::lock_guard pumping(pump_mutex_);
  pump(0);
}

void NodeCore::pump(int timeout_ms) {
  epoll_event event{};
  static_cast<void>(epoll_wait(epoll_.get(), &event, 1, timeout_ms));
  tidy();
  const Socket socket = this->socket();
  if (socket == nullptr) {
    std::uint64_t rings = 0;
    if (::read(timer_.get(), &rings, sizeof rings) > 0) rejoin();
    return;
  }
  shm::Received received;
  for (;;) {
    switch (shm::receive_message(socket->get(), received, false)) {
      case shm::ReceiveResult::kReceived:
        handle(received);
        break;
      case shm::ReceiveResult::kNothing:
        return;
      case shm::ReceiveResult::kClosed:
      case shm::ReceiveResult::kMalformed:
        lose_daemon();
        return;
    }
    if (this->socket() != socket) return;
  }
}

void NodeCore::tidy() {
  const std::lock_guard lock(mutex_);
  service_bell_->silence();
  for (auto& [instance, output] : outputs_) {
    output->tidy();
    for (const shm::PortInstance peer : output->misbehaving()) {
      say_refused(instance, peer,
                  "the input port misbehaves: it says that it has read what was never published");
    }
  }
  for (auto& [instance, input] : inputs_) {
    input->tidy();
    for (const shm::PortInstance peer : input->misbehaving()) {
      say_refused(instance, peer,
                  "the output port misbehaves: its queue has what no honest publisher writes");
    }
  }
}

void NodeCore::handle(shm::Received& received) {
  const shm::Message& message = received.message;
  switch (message.kind) {
    case shm::MessageKind::kWelcome:
      be_welcomed(received);
      break;
    case shm::MessageKind::kSourcePage:
      try {
        memory_->add_page(message.id, std::string(message.name_view()),
                          std::move(received.descriptors[0]));
        wake_inputs();
      } catch (const std::exception& error) {
        refuse_peer(message, error.what());
      }
      break;
    case shm::MessageKind::kPortName: {
      const std::lock_guard lock(mutex_);
      port_names_[message.id] = message.name_view();
      break;
    }
    case shm::MessageKind::kInputPeer:
    case shm::MessageKind::kOutputPeer:
    case shm::MessageKind::kPeerGone:
    case shm::MessageKind::kDisconnected:
      try {
        handle_peer(received);
      } catch (const std::exception& error) {
        refuse_peer(message, error.what());
      }
      break;
    case shm::MessageKind::kSync: {
      shm::Message synced;
      synced.kind = shm::MessageKind::kSynced;
      synced.request = message.request;
      const std::lock_guard lock(mutex_);
      say(synced);
      break;
    }
    default:
      handle_reply(received);
      break;
  }
}

// A port that could not see a source may have held back a sample and gone to sleep.
void NodeCore::wake_inputs() {
  const std::lock_guard lock(mutex_);
  for (const auto& [instance, input] : inputs_) {
    shm::ring_bell(input->bell().write_end().get());
  }
}

void NodeCore::handle_peer(shm::Received& received) {
  const shm::Message& message = received.message;
  const std::lock_guard lock(mutex_);
  const auto output = outputs_.find(message.port);
  const auto input = inputs_.find(message.port);
  if (output != outputs_.end()) {
    OutputCore& core = *output->second;
    if (message.kind == shm::MessageKind::kInputPeer) {
      core.add_peer(map_input_peer(received, core.type()),
                    (message.flags & shm::kIsConnected) != 0 ? message.link : 0);
    } else if (message.kind == shm::MessageKind::kPeerGone) {
      core.remove_peer(message.peer);
    } else if (message.kind == shm::MessageKind::kDisconnected) {
      core.disconnect_peer(message.peer);
    }
  } else if (input != inputs_.end()) {
    InputCore& core = *input->second;
    if (message.kind == shm::MessageKind::kOutputPeer) {
      core.add_peer(map_output_peer(received, core.type()));
    } else if (message.kind == shm::MessageKind::kPeerGone) {
      core.lose_peer(message.peer);
    } else if (message.kind == shm::MessageKind::kDisconnected) {
      core.disconnect_peer(message.peer);
    }
  }
}

// Tells the daemon, so that it shows in its status.
void NodeCore::refuse_peer(const shm::Message& announced, const std::string& why) {
  const std::lock_guard lock(mutex_);
  say_refused(announced.port, announced.peer, why);
}

void NodeCore::say_refused(shm::PortInstance port, shm::PortInstance peer, const std::string& why) {
  shm::Message refusal;
  refusal.kind = shm::MessageKind::kPeerRefused;
  refusal.port = port;
  refusal.peer = peer;
  refusal.set_text(why);
  say(refusal);
}

void NodeCore::handle_reply(shm::Received& received) {
  const shm::Message& message = received.message;
  const std::lock_guard lock(mutex_);
  if (message.kind == shm::MessageKind::kRefused && standing_ == Standing::kRejoining) {
    be_turned_away(message);
    return;
  }
  const auto found = replies_.find(message.request);
  if (found == replies_.end()) {
    // Nobody waits for it any more.
    if (message.kind == shm::MessageKind::kOpened) say_closed(message.port);
    return;
  }
  Reply& reply = found->second;
  if (message.kind == shm::MessageKind::kOpened) {
    try {
      if (reply.on_opened) reply.on_opened(received);
      reply.opened = message.port;
    } catch (const std::exception& error) {
      reply.refusal = error.what();
      say_closed(message.port);
    }
    return;
  }
  if (message.kind == shm::MessageKind::kRefused) reply.refusal = message.text_view();
  reply.received = std::move(received);
  reply.finished = true;
  news_.notify_all();
}

}  // namespace arbiter::detail
