// Losing the daemon, and coming back to another.
//
// All that data needs to flow is mapped already, so for the ports nothing changes. The next daemon
// is handed back the memory that the last one made, and told of each port and its links
// (service/takeover/takeover.hpp).
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>

#include <optional>
#include <utility>
#include <vector>

#include "client/node/ended_nodes.hpp"
#include "client/node/node_core.hpp"
#include "shm/clock.hpp"
#include "shm/segment.hpp"
#include "wire/meeting.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::detail {

namespace {

// How often a daemon is looked for.
constexpr std::chrono::milliseconds kRejoinInterval{50};
// How long until it is tried again with a daemon that does not want us, or that has shown us what
// could not be taken up.
constexpr std::chrono::milliseconds kTurnedAwayInterval{1000};

// One comes each second.
constexpr int kToldRefusal = 3;

}  // namespace

bool NodeCore::watch_socket() {
  epoll_event event{};
  event.events = heeded_ = EPOLLIN;
  return epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, socket_->get(), &event) == 0;
}

// 0: never.
void NodeCore::ring_timer_every(Clock::duration time) const {
  const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(time).count();
  itimerspec at{};
  at.it_value = at.it_interval = {ns / 1'000'000'000, ns % 1'000'000'000};
  timerfd_settime(timer_.get(), 0, &at, nullptr);
}

void NodeCore::lose_daemon() noexcept { be_alone(kRejoinInterval); }

void NodeCore::be_alone(Clock::duration look_again_in) noexcept {
  if (socket_ != nullptr) epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, socket_->get(), nullptr);
  hang_up();
  socket_ = nullptr;
  due_.clear();
  due_has_too_many_ = false;
  outbox_.clear();
  given_up_.clear();
  standing_ = Standing::kAlone;
  ring_timer_every(look_again_in);
  news_.notify_all();
}

void NodeCore::rejoin() {
  std::string why_not;
  std::optional<shm::FileDescriptor> found;
  try {
    found = wire::connect_to_daemon(instance_, why_not, nullptr, SOCK_NONBLOCK);
  } catch (const std::exception&) {  // no descriptors are left: another time
  }
  if (!found) return;
  shm::close_in_children(*found);
  const std::lock_guard lock(mutex_);
  begin_to_hand_back();
  socket_ = std::make_shared<const shm::FileDescriptor>(std::move(*found));
  if (!watch_socket()) {
    be_alone(kTurnedAwayInterval);
    return;
  }
  standing_ = Standing::kRejoining;
  ring_timer_every({});
  asked_ = shm::monotonic_now();
  say_what_waits();
  if (!options_.service_thread) ring_when_to_look_again();
}

void NodeCore::be_welcomed(wire::Received& welcome) {
  const std::lock_guard lock(mutex_);
  if (standing_ != Standing::kRejoining) return;
  const std::string fault = wire::find_fault_in_clock(welcome.message, asked_);
  if (!fault.empty()) {
    // Once, though each time it is measured a little otherwise.
    if (!std::exchange(has_told_of_clock_, true)) note(NoticeKind::apart, 0, {}, fault);
    put_off(fault);
    return;
  }
  has_told_of_clock_ = false;
  if (!shm::are_one_segment(welcome.descriptors[0], memory_->board())) {
    try {
      if (!has_no_ports_) throw std::runtime_error("the daemon has other memory");
      memory_ = std::make_shared<SharedMemory>(std::move(welcome.descriptors[0]),
                                               std::move(welcome.descriptors[1]), service_bell_,
                                               residence());
      missed_pages_.clear();
      ring_for_ended(service_bell_, shm::identity_of(memory_->board()), options_.service_thread);
    } catch (const std::exception& error) {
      put_off(error.what());
      return;
    }
  }
  standing_ = Standing::kMember;
  ++conversation_;
  node_ = welcome.message.link;
  turned_away_.clear();
  refusals_ = 0;
  say_who_has_ended(Whom::kAll);
  for (const auto& [instance, output] : outputs_) output->doubt_taps();
  describe_again();
  reopen_taps();
  say_what_waits();
  if (has_too_many()) service_bell_->ring();  // as say()
  news_.notify_all();
}

void NodeCore::put_off(const std::string& why) {
  turned_away_ = why;
  be_alone(kTurnedAwayInterval);
}

// The conversation is over; but the daemon may be replaced by one that knows us. It is told once,
// and not if a daemon merely has no descriptor to spare for a moment.
void NodeCore::be_turned_away(const wire::Message& refusal) {
  const std::string why(refusal.text_view());
  if (++refusals_ == kToldRefusal) {
    note(NoticeKind::apart, 0, {},
         "components that come now do not see \"" + name_ +
             "\", which goes on with those that it is connected to: " + why);
  }
  put_off(why);
}

}  // namespace arbiter::detail
