// Connecting; questions and answers.
#include "client/node/node_core.hpp"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <utility>

#include "client/node/ended_nodes.hpp"
#include "client/node/names.hpp"
#include "wire/call.hpp"
#include "wire/instances.hpp"
#include "wire/meeting.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::detail {
namespace {

using std::chrono::milliseconds;

// Without a service thread: how often a caller that waits looks whether there is news.
constexpr milliseconds kConnectInterval{20};
// The longest time to wait for one; longer means for ever.
constexpr milliseconds kMaxConnectTimeout = std::chrono::hours(24 * 365);
// A daemon that is there has at least this long to answer: it may be taking over from another.
constexpr milliseconds kMinAnswerTime{1000};
// Nobody is told of a shorter wait.
constexpr milliseconds kQuietWait{500};

std::string port_to_open(const wire::Message& question) {
  if (question.kind == wire::MessageKind::kOpenOutput) {
    return "output " + std::string(question.name_view());
  }
  if (question.kind == wire::MessageKind::kOpenInput) {
    return "input " + std::string(question.name_view());
  }
  return {};
}

}  // namespace

NodeCore::NodeCore(std::string_view name, const NodeOptions& options)
    : name_(name), options_(options) {
  check_name(name, "a node");
  if (options.connect_timeout < milliseconds::zero()) {
    throw Error("connect_timeout is " + std::to_string(options.connect_timeout.count()) +
                " ms, but must not be below 0");
  }
  try {
    service_bell_ = std::make_shared<const ServiceBell>();
    instance_ = wire::instance_name(options.instance);
    connect();
    if (options.service_thread) start_service_thread();
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw Error(error.what());
  } catch (const ThrownByCallback& callback) {
    std::rethrow_exception(callback.thrown);
  }
}

NodeCore::~NodeCore() {
  stop_service_thread();
  say_the_end();
  hang_up();
}

// A descendant may have the socket open too: what ends the conversation must not wait for it.
void NodeCore::hang_up() const noexcept {
  if (socket_ != nullptr) ::shutdown(socket_->get(), SHUT_RDWR);
}

void NodeCore::connect() {
  wire::Welcome welcome = wire::join(caller());
  const std::string fault = wire::find_fault_in_clock(welcome.received.message, welcome.asked);
  if (!fault.empty()) throw Error(fault);
  socket_ = std::make_shared<const shm::FileDescriptor>(std::move(welcome.socket));
  make_non_blocking(*socket_);
  auto& [board, registry] = welcome.received.descriptors;
  memory_ = std::make_shared<SharedMemory>(std::move(board), std::move(registry), service_bell_,
                                           residence());
  node_ = welcome.received.message.link;
  epoll_.reset(epoll_create1(EPOLL_CLOEXEC));
  timer_.reset(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
  if (!epoll_ || !timer_) throw Error(wire::no_descriptor_left("the daemon's messages"));
  shm::close_in_children(epoll_);
  shm::close_in_children(timer_);
  epoll_event event{};
  event.events = EPOLLIN;
  if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, service_bell_->descriptor(), &event) != 0 ||
      epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, timer_.get(), &event) != 0 || !watch_socket()) {
    throw Error(std::string("no descriptor for the daemon's messages: ") + std::strerror(errno));
  }
  ring_for_ended(service_bell_, shm::identity_of(memory_->board()), options_.service_thread);
  note_second_daemons(welcome.directory);
}

void NodeCore::note_second_daemons(const std::string& met_in) {
  for (const std::string& path : wire::other_daemons(instance_, met_in)) {
    const std::string met = met_in + "/" + instance_ + ".sock";
    const std::lock_guard lock(mutex_);
    note(NoticeKind::apart, 0, {}, wire::describe_second_daemon(instance_, met, path));
  }
  give_notices();
}

shm::Residence NodeCore::residence() const noexcept {
  return options_.lock_memory ? shm::Residence::kLocked : shm::Residence::kMapped;
}

wire::Caller NodeCore::caller() const {
  wire::Caller caller;
  caller.name = name_;
  caller.instance = instance_;
  caller.flags = wire::kComesBack | (options_.service_thread ? wire::kHasServiceThread : 0u);
  caller.patience = options_.connect_timeout;
  caller.answer_time = kMinAnswerTime;
  caller.quiet = kQuietWait;
  // One that comes at the last moment has its time to answer, too.
  caller.on_waiting = [this](const std::string& whom) {
    say_that_we_wait(whom, std::min(options_.connect_timeout, kMaxConnectTimeout) + kMinAnswerTime);
  };
  return caller;
}

wire::Message NodeCore::hello() const {
  wire::Message hello = wire::hello_of(caller());
  hello.link = node_;
  return hello;
}

// Not under a lock: a callback may do what it likes, and throw.
void NodeCore::say_that_we_wait(const std::string& whom, milliseconds most) const {
  static thread_local bool is_inside = false;
  if (std::exchange(is_inside, true)) return;
  const std::unique_ptr<bool, void (*)(bool*)> leave(&is_inside, [](bool* is) { *is = false; });
  const std::string text =
      "\"" + name_ + "\" waits for " + whom + ", at most " + std::to_string(most.count()) + " ms";
  if (!options_.on_waiting) {
    std::fprintf(stderr, "arbiter: %s\n", text.c_str());
    return;
  }
  try {
    options_.on_waiting(text);
  } catch (...) {
    throw ThrownByCallback{std::current_exception()};
  }
}

std::shared_ptr<SharedMemory> NodeCore::memory() {
  const std::lock_guard lock(mutex_);
  return memory_;
}

// Of a tap, whose number may be another's by now, only the daemon is told: see open_tap().
void NodeCore::forget_port(shm::PortInstance port) {
  outputs_.erase(port);
  inputs_.erase(port);
  given_.erase(port);
  descriptions_.erase(port);
  say_closed(port);
}

wire::Received NodeCore::ask(const wire::Message& question,
                             std::array<int, wire::kMaxDescriptors> descriptors) {
  try {
    return converse(question, descriptors);
  } catch (const ThrownByCallback& callback) {
    std::rethrow_exception(callback.thrown);
  }
}

bool NodeCore::wait_for_news(std::unique_lock<std::mutex>& lock, Clock::time_point give_up) {
  if (Clock::now() >= give_up) return false;
  // A callback on the service thread may open ports: then it serves itself.
  const bool is_served =
      service_thread_.joinable() && service_thread_.get_id() != std::this_thread::get_id();
  if (is_served) {
    news_.wait_until(lock, give_up);
    return true;
  }
  lock.unlock();
  {
    const std::lock_guard pumping(pump_mutex_);
    pump(static_cast<int>(kConnectInterval.count()));
  }
  give_notices();
  lock.lock();
  return true;
}

// Nobody waits for the answer any more.
void NodeCore::give_up_on(std::uint64_t request) {
  const auto unanswered = replies_.extract(request);
  if (unanswered.mapped().asked_in == conversation_ && standing_ == Standing::kMember) {
    const std::string& opens = unanswered.mapped().opens;
    if (!outbox_.withdraw(request) && !opens.empty()) given_up_.emplace(request, opens);
    heed();
  }
  if (unanswered.mapped().opened != 0) forget_port(unanswered.mapped().opened);
}

void NodeCore::say_that_we_wait(std::unique_lock<std::mutex>& lock, std::uint64_t request,
                                milliseconds most) {
  const Socket asked = standing_ == Standing::kMember ? socket_ : nullptr;
  lock.unlock();
  try {
    say_that_we_wait(asked == nullptr
                         ? "an arbiterd of instance \"" + instance_ + '"'
                         : wire::describe_daemon(asked->get(), instance_) + " to answer",
                     most);
  } catch (...) {
    lock.lock();
    give_up_on(request);
    throw;
  }
  lock.lock();
}

wire::Received NodeCore::converse(const wire::Message& question,
                                  std::array<int, wire::kMaxDescriptors> descriptors,
                                  const SharedMemory* memory,
                                  std::function<void(wire::Received&)> on_opened) {
  const auto begin = Clock::now();
  const milliseconds most =
      std::clamp(options_.connect_timeout, kMinAnswerTime, kMaxConnectTimeout);
  const auto give_up = begin + most;
  bool said = false;
  wire::Message numbered = question;
  std::unique_lock lock(mutex_);
  const std::uint64_t request = numbered.request = next_request_++;
  Reply& reply = replies_[request];
  reply.on_opened = std::move(on_opened);
  reply.opens = port_to_open(question);
  while (!reply.finished) {
    if (memory != nullptr && memory != memory_.get()) {
      replies_.erase(request);
      throw MemoryIsNew();
    }
    if (standing_ == Standing::kMember && reply.asked_in != conversation_) {
      reply.asked_in = conversation_;
      reply.is_behind_given_up =
          !reply.has_asked_again &&
          std::any_of(given_up_.begin(), given_up_.end(),
                      [&](const auto& each) { return each.second == reply.opens; });
      say_who_has_ended(Whom::kAll);  // before a name is asked for that is kept for one of them
      // A port that another daemon has opened was handed back to this one: what is left is to be
      // connected.
      if (question.kind == wire::MessageKind::kOpenTap) {
        reply.opened = 0;
        reply.refusal.clear();
      }
      if (reply.opened != 0) {
        numbered = wire::Message();
        numbered.kind = wire::MessageKind::kConnect;
        numbered.request = request;
        numbered.port = reply.opened;
        descriptors = {-1, -1};
      }
      // If the conversation is over after this, the next one asks again.
      say(numbered, descriptors);
    }
    if (!said && Clock::now() - begin >= kQuietWait) {
      said = true;
      say_that_we_wait(lock, request, most);
      continue;
    }
    const auto until = said ? give_up : std::min(give_up, Clock::now() + kQuietWait);
    if (wait_for_news(lock, until) || until < give_up) continue;
    const bool is_there = standing_ == Standing::kMember;
    give_up_on(request);
    throw Error(is_there ? "the daemon is there, but has not answered in time"
                         : wire::nobody_answers(caller(), turned_away_));
  }
  const auto answered = replies_.extract(request);
  if (!answered.mapped().refusal.empty()) {
    if (answered.mapped().opened != 0) forget_port(answered.mapped().opened);
    throw Error(answered.mapped().refusal);
  }
  return std::move(answered.mapped().received);
}

}  // namespace arbiter::detail
