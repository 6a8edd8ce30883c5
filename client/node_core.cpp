#include "client/node_core.hpp"

#include <cxxabi.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "shm/rendezvous.hpp"

namespace arbiter::detail {
namespace {

using Clock = std::chrono::steady_clock;

// How often a client looks for a daemon that does not answer yet.
constexpr auto kConnectInterval = std::chrono::milliseconds(20);
// The longest time to wait for one; longer means for ever.
constexpr std::chrono::milliseconds kMaxConnectTimeout = std::chrono::hours(24 * 365);
// The longest wait for an answer before looking for another daemon.
constexpr std::chrono::milliseconds kMaxAnswerTime = std::chrono::seconds(60);
constexpr std::chrono::milliseconds kMinAnswerTime{100};
// How much less than a normal thread the service thread presses for the processor.
constexpr int kServiceNiceness = 5;

void check_name(std::string_view name, const char* what) {
  const bool printable = std::all_of(name.begin(), name.end(), [](char c) {
    return static_cast<unsigned char>(c) > ' ' && c != '\x7f';
  });
  if (name.empty() || name.size() > shm::kMaxNameLength || !printable) {
    throw Error("\"" + std::string(name) + "\" is not a name for " + what + ": use 1 to " +
                std::to_string(shm::kMaxNameLength) + " bytes without white space");
  }
}

void check_port_name(std::string_view name) {
  check_name(name, "a port");
  if (name[0] != '/') throw Error("\"" + std::string(name) + "\": a port's name begins with '/'");
}

template <class Value>
void check_bounds(std::string_view port, const char* option, Value value, Value least, Value most) {
  if (value >= least && value <= most) return;
  throw Error(std::string(port) + ": " + option + " is " + std::to_string(value) +
              ", but must be from " + std::to_string(least) + " to " + std::to_string(most));
}

std::string readable(const char* type_name) {
  int status = 0;
  char* const demangled = abi::__cxa_demangle(type_name, nullptr, nullptr, &status);
  std::string result = status == 0 ? demangled : type_name;
  std::free(demangled);  // NOLINT: that is how __cxa_demangle hands it out
  return result;
}

// A name that is too long ends in a hash of the whole, so that two that differ stay different.
std::string fitting(std::string name) {
  if (name.size() <= shm::kMaxTypeName) return name;
  std::uint64_t hash = 0xcbf29ce484222325;  // FNV-1a: the same in every program
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  char tail[20];
  const int length = std::snprintf(tail, sizeof tail, "...%016llx", 0ULL + hash);
  return name.substr(0, shm::kMaxTypeName - static_cast<std::size_t>(length)) + tail;
}

shm::TypeInfo type_info(const PortType& type) {
  shm::TypeInfo info;
  if (type.name != nullptr) info.set_name(fitting(readable(type.name)));
  info.size = type.size;
  info.alignment = type.alignment;
  return info;
}

shm::Message message_of(shm::MessageKind kind, std::string_view name = {}) {
  shm::Message message;
  message.kind = kind;
  message.set_name(name);
  return message;
}

}  // namespace

NodeCore::NodeCore(std::string_view name, const NodeOptions& options) {
  check_name(name, "a node");
  try {
    instance_ = shm::instance_name(options.instance);
    connect(name, options);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw Error(error.what());
  }
  if (options.service_thread) service_thread_ = std::thread([this] { run_service_thread(); });
}

NodeCore::~NodeCore() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  if (!service_thread_.joinable()) return;
  memory_->service_bell().ring();
  // The last port may go on the service thread itself, if that was the last to use it.
  if (service_thread_.get_id() == std::this_thread::get_id()) {
    service_thread_.detach();
  } else {
    service_thread_.join();
  }
}

void NodeCore::connect(std::string_view name, const NodeOptions& options) {
  const auto give_up = Clock::now() + std::min(options.connect_timeout, kMaxConnectTimeout);
  std::string why_not;
  for (;;) {
    if (auto socket = shm::connect_to_daemon(instance_, why_not)) {
      socket_ = std::move(*socket);
      shm::Message hello = message_of(shm::MessageKind::kHello, name);
      hello.value = shm::kWireVersion;
      hello.flags = options.service_thread ? shm::kHasServiceThread : 0u;
      shm::Received welcome;
      pollfd readable{socket_.get(), POLLIN, 0};
      const auto left =
          std::clamp(std::chrono::duration_cast<std::chrono::milliseconds>(give_up - Clock::now()),
                     kMinAnswerTime, kMaxAnswerTime);
      if (shm::send_message(socket_.get(), hello) == shm::SendResult::kSent &&
          ::poll(&readable, 1, static_cast<int>(left.count())) == 1 &&
          shm::receive_message(socket_.get(), welcome, false) == shm::ReceiveResult::kReceived) {
        if (welcome.message.kind == shm::MessageKind::kRefused) {
          throw Error("the daemon refuses: " + std::string(welcome.message.text_view()));
        }
        memory_ = std::make_shared<SharedMemory>(welcome.descriptors[0]);
        break;
      }
    }
    if (Clock::now() >= give_up) {
      throw Error("no arbiterd of instance \"" + instance_ + "\" answered within " +
                  std::to_string(options.connect_timeout.count()) + " ms" +
                  (why_not.empty() ? "" : " (" + why_not + ")") +
                  "; start one with: arbiterd --model FILE --instance " + instance_);
    }
    std::this_thread::sleep_for(
        std::min<Clock::duration>(kConnectInterval, give_up - Clock::now()));
  }
  epoll_.reset(epoll_create1(EPOLL_CLOEXEC));
  epoll_event event{};
  event.events = EPOLLIN;
  if (!epoll_ || epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, socket_.get(), &event) != 0 ||
      epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, memory_->service_bell().descriptor(), &event) != 0) {
    throw Error(std::string("no descriptor for the daemon's messages: ") + std::strerror(errno));
  }
}

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
    if (!pump(-1)) break;
  }
  // The daemon is gone. Data flows on; only tidying up is left to do.
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      memory_->service_bell().silence();
      // Looked at after that: the ring may have been the one that tells us to stop.
      if (stopping_) return;
      for (auto& [instance, output] : outputs_) output->tidy();
      for (auto& [instance, input] : inputs_) input->tidy();
    }
    pollfd bell{memory_->service_bell().descriptor(), POLLIN, 0};
    ::poll(&bell, 1, -1);
  }
}

// Where there is a service thread, it does this.
void NodeCore::service() {
  if (service_thread_.joinable()) return;
  const std::lock_guard pumping(pump_mutex_);
  pump(0);
}

bool NodeCore::pump(int timeout_ms) {
  epoll_event event{};
  static_cast<void>(epoll_wait(epoll_.get(), &event, 1, timeout_ms));
  {
    const std::lock_guard lock(mutex_);
    if (daemon_gone_) return false;
    memory_->service_bell().silence();
    for (auto& [instance, output] : outputs_) output->tidy();
    for (auto& [instance, input] : inputs_) input->tidy();
  }
  shm::Received received;
  for (;;) {
    switch (shm::receive_message(socket_.get(), received, false)) {
      case shm::ReceiveResult::kReceived:
        handle(received);
        break;
      case shm::ReceiveResult::kNothing:
        return true;
      case shm::ReceiveResult::kClosed:
      case shm::ReceiveResult::kMalformed:
        lose_daemon();
        return false;
    }
  }
}

void NodeCore::lose_daemon() {
  const std::lock_guard lock(mutex_);
  daemon_gone_ = true;
  for (auto& [request, reply] : replies_) {
    reply.finished = true;
    reply.refusal = "the daemon is gone";
  }
  replied_.notify_all();
}

void NodeCore::send(const shm::Message& message,
                    std::array<int, shm::kMaxDescriptors> descriptors) {
  // The socket blocks: a client has little to say, and the daemon always listens.
  if (shm::send_message(socket_.get(), message, descriptors) != shm::SendResult::kSent) {
    throw Error("the daemon is gone; ports that are open work on, new ones need it");
  }
}

void NodeCore::handle(shm::Received& received) {
  const shm::Message& message = received.message;
  switch (message.kind) {
    case shm::MessageKind::kSourcePage:
      try {
        memory_->add_page(message.id, std::string(message.name_view()), received.descriptors[0]);
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
      shm::Message synced = message_of(shm::MessageKind::kSynced);
      synced.request = message.request;
      static_cast<void>(shm::send_message(socket_.get(), synced));
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
  shm::Message refusal = message_of(shm::MessageKind::kPeerRefused);
  refusal.port = announced.port;
  refusal.peer = announced.peer;
  refusal.set_text(why);
  static_cast<void>(shm::send_message(socket_.get(), refusal));
}

void NodeCore::handle_reply(shm::Received& received) {
  const shm::Message& message = received.message;
  const std::lock_guard lock(mutex_);
  const auto found = replies_.find(message.request);
  if (found == replies_.end()) return;
  Reply& reply = found->second;
  if (message.kind == shm::MessageKind::kOpened) {
    try {
      if (reply.on_opened) reply.on_opened(received);
      reply.opened = true;
    } catch (const std::exception& error) {
      reply.refusal = error.what();
      shm::Message close = message_of(shm::MessageKind::kClosePort);
      close.port = message.port;
      static_cast<void>(shm::send_message(socket_.get(), close));
    }
    return;
  }
  if (message.kind == shm::MessageKind::kRefused) reply.refusal = message.text_view();
  reply.received = std::move(received);
  reply.finished = true;
  replied_.notify_all();
}

shm::Received NodeCore::ask(const shm::Message& question,
                            std::array<int, shm::kMaxDescriptors> descriptors) {
  return converse(question, descriptors, nullptr);
}

shm::Received NodeCore::converse(const shm::Message& question,
                                 std::array<int, shm::kMaxDescriptors> descriptors,
                                 std::function<void(const shm::Received&)> on_opened) {
  shm::Message numbered = question;
  {
    const std::lock_guard lock(mutex_);
    if (daemon_gone_)
      throw Error("the daemon is gone; ports that are open work on, new ones need it");
    numbered.request = next_request_++;
    replies_[numbered.request].on_opened = std::move(on_opened);
  }
  try {
    send(numbered, descriptors);
  } catch (...) {
    const std::lock_guard lock(mutex_);
    replies_.erase(numbered.request);
    throw;
  }
  const auto finished = [&] { return replies_[numbered.request].finished; };
  if (service_thread_.joinable()) {
    std::unique_lock lock(mutex_);
    replied_.wait(lock, finished);
  } else {
    const std::lock_guard pumping(pump_mutex_);
    for (;;) {
      {
        const std::lock_guard lock(mutex_);
        if (finished()) break;
      }
      pump(-1);
    }
  }
  const std::lock_guard lock(mutex_);
  const auto reply = replies_.extract(numbered.request);
  if (!reply.mapped().refusal.empty()) throw Error(reply.mapped().refusal);
  return std::move(reply.mapped().received);
}

std::shared_ptr<OutputCore> NodeCore::open_output(std::string_view name, const PortType& type,
                                                  const OutputPortOptions& options) {
  check_port_name(name);
  check_bounds<std::uint32_t>(name, "max_loans", options.max_loans, 1, shm::kMaxLoans);
  check_bounds<std::size_t>(name, "max_size", type.size, 0, std::size_t{1} << 40);
  check_bounds<std::size_t>(name, "max_memory", options.max_memory,
                            OutputCore::least_memory(type_info(type), options.max_loans),
                            std::size_t{1} << 46);
  try {
    auto core = std::make_shared<OutputCore>(std::string(name), type_info(type), options, memory_);
    core->node = shared_from_this();
    shm::Message open = message_of(shm::MessageKind::kOpenOutput, name);
    open.type = core->type();
    converse(open, {core->segment_descriptor().get(), -1}, [&](const shm::Received& opened) {
      core->bind(opened.message.port, opened.message.id, opened.descriptors[0]);
      outputs_[opened.message.port] = core;
    });
    return core;
  } catch (const std::system_error& error) {
    throw Error(std::string(name) + ": " + error.what());
  }
}

std::shared_ptr<InputCore> NodeCore::open_input(std::string_view name, const PortType& type,
                                                const InputPortOptions& options) {
  check_port_name(name);
  check_bounds<std::uint32_t>(name, "depth", options.depth, 1, shm::kMaxDepth);
  check_bounds<std::uint32_t>(name, "max_held", options.max_held, 1, shm::kMaxHeld);
  try {
    auto core = std::make_shared<InputCore>(std::string(name), type_info(type), options, memory_);
    core->node = shared_from_this();
    shm::Message open = message_of(shm::MessageKind::kOpenInput, name);
    open.type = core->type();
    converse(open, {core->segment_descriptor().get(), core->bell().write_end().get()},
             [&](const shm::Received& opened) {
               core->bind(opened.message.port, opened.message.id);
               inputs_[opened.message.port] = core;
             });
    return core;
  } catch (const std::system_error& error) {
    throw Error(std::string(name) + ": " + error.what());
  }
}

void NodeCore::close(shm::PortInstance port) noexcept {
  std::shared_ptr<OutputCore> output;  // destroyed after the lock is released
  std::shared_ptr<InputCore> input;
  shm::Message message = message_of(shm::MessageKind::kClosePort);
  message.port = port;
  const std::lock_guard lock(mutex_);
  if (const auto found = outputs_.find(port); found != outputs_.end()) {
    output = std::move(found->second);
    outputs_.erase(found);
  }
  if (const auto found = inputs_.find(port); found != inputs_.end()) {
    input = std::move(found->second);
    inputs_.erase(found);
  }
  static_cast<void>(shm::send_message(socket_.get(), message));
}

std::map<shm::PortId, std::string> NodeCore::port_names() {
  const std::lock_guard lock(mutex_);
  return port_names_;
}

}  // namespace arbiter::detail
