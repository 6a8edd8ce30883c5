#include "watch/instance.hpp"

#include <poll.h>
#include <sys/epoll.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "shm/clock.hpp"
#include "shm/descendants.hpp"
#include "shm/segment.hpp"
#include "wire/document.hpp"
#include "wire/instances.hpp"
#include "wire/meeting.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::watch {
namespace {

using std::chrono::milliseconds;

// How often a daemon is looked for, and one that did not want us.
constexpr milliseconds kLookInterval{50};
constexpr milliseconds kTurnedAwayInterval{1000};
// Of those that update() takes up in one go, so that its caller comes to its own work.
constexpr int kMostMessages = 4096;

wire::Message message_of(wire::MessageKind kind) {
  wire::Message message;
  message.kind = kind;
  return message;
}

}  // namespace

Instance::Instance(wire::Caller caller) : caller_(std::move(caller)) {
  wire::Welcome welcome = wire::join(caller_);
  const std::string fault = wire::find_fault_in_clock(welcome.received.message, welcome.asked);
  if (!fault.empty()) throw wire::CallError(fault);
  epoll_.reset(epoll_create1(EPOLL_CLOEXEC));
  timer_.reset(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
  shm::close_in_children(epoll_);
  shm::close_in_children(timer_);
  socket_ = std::move(welcome.socket);
  epoll_event event{};
  event.events = EPOLLIN;
  if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, timer_.get(), &event) != 0 || !watch_socket()) {
    throw std::system_error(errno, std::generic_category(), "no descriptor to watch the daemon");
  }
  take_up_memory(welcome.received);
  standing_ = Standing::kIn;
  daemons_ = 1;
  catch_up();
}

// Nothing is handed on to a daemon's successor: components do that.
void Instance::take_up_memory(wire::Received& welcome) {
  if (memory_ != nullptr && shm::are_one_segment(welcome.descriptors[0], memory_->board())) return;
  memory_ = std::make_shared<shm::DecisionMemory>(std::move(welcome.descriptors[0]),
                                                  shm::Residence::kMapped,
                                                  shm::DecisionMemory::Whose::kWatchers);
  shared_ = memory_;
  port_names_.clear();
  port_ids_.clear();
  source_ids_.clear();
}

void Instance::update() {
  std::uint64_t rings = 0;
  if (standing_ == Standing::kAlone) {
    if (::read(timer_.get(), &rings, sizeof rings) > 0) look_for_daemon();
    return;
  }
  wire::Received received;
  for (int i = 0; i < kMostMessages && standing_ != Standing::kAlone; ++i) {
    switch (wire::receive_message(socket_.get(), received, false)) {
      case wire::ReceiveResult::kReceived:
        handle(received);
        break;
      case wire::ReceiveResult::kNothing:
        return;
      case wire::ReceiveResult::kClosed:
      case wire::ReceiveResult::kMalformed:
        lose_daemon(kLookInterval);
        break;
    }
  }
}

void Instance::handle(wire::Received& received) {
  const wire::Message& message = received.message;
  if (standing_ == Standing::kGreeting) {
    be_greeted(received);
    return;
  }
  if (message.kind == wire::MessageKind::kSourcePage) {
    add_page(received);
  } else if (message.kind == wire::MessageKind::kPortName) {
    add_port_name(message.id, std::string(message.name_view()));
  } else if (message.request == asked_) {
    answer_ = std::move(received);
  }
}

// A source whose page cannot be had stays unseen.
void Instance::add_page(wire::Received& received) {
  const wire::Message& message = received.message;
  const std::string name(message.name_view());
  const std::string before = memory_->source_name(message.id);
  try {
    memory_->add_page(message.id, message.value, name, std::move(received.descriptors[0]));
    const auto known = source_ids_.find(before);
    const bool is_renamed = known != source_ids_.end() && known->second == message.id;
    if (is_renamed && before != name) source_ids_.erase(known);
    source_ids_[name] = message.id;
  } catch (const std::exception&) {
  }
}

// A name that nobody needs is given back, of which nobody is told; when it is taken again it has
// another id: the last one counts.
void Instance::add_port_name(shm::PortId id, std::string name) {
  if (id >= shm::kMaxInputPorts) return;
  if (const auto [known, is_new] = port_ids_.try_emplace(name, id); !is_new) {
    if (known->second != id) port_names_.erase(std::exchange(known->second, id));
  }
  std::string& of_id = port_names_[id];
  if (!of_id.empty() && of_id != name) port_ids_.erase(of_id);
  of_id = std::move(name);
}

void Instance::look_for_daemon() {
  std::string why_not;
  std::optional<shm::FileDescriptor> found;
  try {
    found = wire::connect_to_daemon(caller_.instance, why_not);
  } catch (const std::exception&) {  // no descriptors are left: another time
  }
  if (!found) return;
  socket_ = std::move(*found);
  shm::close_in_children(socket_);
  greeted_ = shm::monotonic_now();
  if (!say(wire::hello_of(caller_)) || !watch_socket()) {
    socket_.reset();
    return;
  }
  standing_ = Standing::kGreeting;
  ring_timer_every({});
}

void Instance::be_greeted(wire::Received& welcome) {
  if (welcome.message.kind != wire::MessageKind::kWelcome ||
      !wire::find_fault_in_clock(welcome.message, greeted_).empty()) {
    lose_daemon(kTurnedAwayInterval);
    return;
  }
  try {
    take_up_memory(welcome);
  } catch (const std::exception&) {  // of another version, or no memory is left
    lose_daemon(kTurnedAwayInterval);
    return;
  }
  standing_ = Standing::kIn;
  ++daemons_;
  static_cast<void>(say(message_of(wire::MessageKind::kObserve)));  // the loss is noticed
}

void Instance::lose_daemon(Clock::duration look_again_in) {
  socket_.reset();  // and is watched no more
  standing_ = Standing::kAlone;
  ring_timer_every(look_again_in);
}

bool Instance::watch_socket() const {
  epoll_event event{};
  event.events = EPOLLIN;
  return epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, socket_.get(), &event) == 0;
}

// 0: never.
void Instance::ring_timer_every(Clock::duration time) const {
  const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(time).count();
  itimerspec at{};
  at.it_value = at.it_interval = {ns / 1'000'000'000, ns % 1'000'000'000};
  timerfd_settime(timer_.get(), 0, &at, nullptr);
}

bool Instance::say(const wire::Message& message) const {
  return wire::send_message(socket_.get(), message) == wire::SendResult::kSent;
}

std::optional<shm::PortId> Instance::find_port(std::string_view name) const {
  const auto found = port_ids_.find(name);
  return found == port_ids_.end() ? std::nullopt : std::optional(found->second);
}

std::optional<shm::SourceId> Instance::find_source(std::string_view name) const {
  const auto found = source_ids_.find(name);
  // The id may be another source's by now.
  const bool is_known = found != source_ids_.end() && memory_->source_name(found->second) == name;
  return is_known ? std::optional(found->second) : std::nullopt;
}

wire::Received Instance::ask(const wire::Message& question) {
  const auto give_up = Clock::now() + caller_.answer_time;
  wire::Message numbered = question;
  numbered.request = ++last_request_;
  asked_ = numbered.request;
  answer_.reset();
  std::uint64_t asked_of = 0;
  while (!answer_) {
    if (has_daemon() && asked_of != daemons_) {
      asked_of = daemons_;
      static_cast<void>(say(
          numbered));  // if it cannot be sent the conversation is over, and the next one is asked
    }
    const auto left = std::chrono::ceil<milliseconds>(give_up - Clock::now());
    if (left.count() <= 0) {
      if (!has_daemon()) throw wire::CallError("the daemon has gone, and no other has come");
      throw wire::CallError(wire::describe_daemon(socket_.get(), caller_.instance) +
                            " has not answered in time: " + wire::describe_silence(socket_.get()));
    }
    pollfd readable{epoll_.get(), POLLIN, 0};
    static_cast<void>(::poll(&readable, 1, static_cast<int>(left.count())));
    update();
  }
  wire::Received answer = std::move(*std::exchange(answer_, std::nullopt));
  if (answer.message.kind == wire::MessageKind::kRefused) {
    throw wire::RefusedError(std::string(answer.message.text_view()));
  }
  return answer;
}

void Instance::catch_up() { static_cast<void>(ask(message_of(wire::MessageKind::kObserve))); }

wire::Status Instance::status() {
  const wire::Received answer = ask(message_of(wire::MessageKind::kStatus));
  return wire::read_status(wire::read_document(answer.descriptors[0]));
}

}  // namespace arbiter::watch
