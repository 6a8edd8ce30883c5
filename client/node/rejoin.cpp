// Losing the daemon, and coming back to another.
//
// All that data needs to flow is mapped already, so for the ports nothing changes. The next daemon
// is handed back the memory that the last one made, and told of each port and its links
// (service/takeover/takeover.hpp).
#include <sys/epoll.h>
#include <sys/timerfd.h>

#include <optional>
#include <utility>

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

bool NodeCore::watch_socket() const {
  epoll_event event{};
  event.events = EPOLLIN;
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
  outbox_.clear();
  given_up_.clear();
  standing_ = Standing::kAlone;
  ring_timer_every(look_again_in);
  news_.notify_all();
}

// The daemon takes the page for shown: it shows it again to a node that comes back. The notice is
// of no port in particular: whose rules read the source says so when it is missed.
void NodeCore::miss_page(const std::string& source, const std::string& why) {
  const std::lock_guard lock(mutex_);
  note(NoticeKind::blind, 0, source, "the activity of " + source + " cannot be seen: " + why);
  be_alone(kTurnedAwayInterval);
}

void NodeCore::rejoin() {
  std::string why_not;
  std::optional<shm::FileDescriptor> found;
  try {
    found = wire::connect_to_daemon(instance_, why_not);
  } catch (const std::exception&) {  // no descriptors are left: another time
  }
  if (!found) return;
  make_non_blocking(*found);
  shm::close_in_children(*found);
  const std::lock_guard lock(mutex_);
  socket_ = std::make_shared<const shm::FileDescriptor>(std::move(*found));
  // Who has no ports left may be the last that has the memory, and with it what is active, and
  // which model is in force.
  has_no_ports_ = outputs_.empty() && inputs_.empty();
  asked_ = shm::monotonic_now();
  // A port that is not handed back is kept for us, as for one that is stopped, until we come
  // another time.
  if (!watch_socket() || !hand_back()) {
    turned_away_ = wire::no_descriptor_left("its ports");
    be_alone(kTurnedAwayInterval);
    return;
  }
  heed_room(!outbox_.empty());
  standing_ = Standing::kRejoining;
  ring_timer_every({});
}

// However much it is, lest a component with many ports never comes back.
bool NodeCore::hand_back(const wire::Message& message, Outbox::Descriptors descriptors) noexcept {
  return outbox_.send(socket_->get(), message, descriptors, Outbox::Bound::kNone);
}

template <class Core>
bool NodeCore::hand_back(wire::MessageKind kind, const Core& core, std::uint32_t id,
                         std::uint32_t flags, const shm::FileDescriptor& second) {
  wire::Message port;
  port.kind = kind;
  port.port = core.instance();
  port.id = id;
  port.flags = flags;
  port.type = core.type();
  port.set_name(core.name());
  if (!hand_back(port, {core.segment_descriptor().get(), second.get()})) return false;
  for (const HeldLink& held : core.held_links()) {
    wire::Message link;
    link.kind = wire::MessageKind::kHandBackLink;
    link.port = core.instance();
    link.peer = held.peer;
    link.link = held.number;
    if (!hand_back(link)) return false;
  }
  return true;
}

bool NodeCore::hand_back() {
  wire::Message message = hello();
  message.flags |= wire::kRejoins | (has_no_ports_ ? wire::kHasNoPorts : 0u);
  if (!hand_back(message, {memory_->board().get(), memory_->registry().get()})) return false;
  for (const auto& page : memory_->pages_at_hand()) {
    message = {};
    message.kind = wire::MessageKind::kHandBackPage;
    message.id = page.source;
    message.value = page.number;
    if (!hand_back(message, {page.descriptor, -1})) return false;
  }
  for (const auto& [instance, core] : outputs_) {
    const std::uint32_t flags = core->yields() ? wire::kYields : 0u;
    if (!hand_back(wire::MessageKind::kHandBackOutput, *core, core->source(), flags,
                   core->page_descriptor())) {
      return false;
    }
  }
  for (const auto& [instance, core] : inputs_) {
    core->set_measured(false);  // unless the next daemon says so
    if (!hand_back(wire::MessageKind::kHandBackInput, *core, core->port(), 0,
                   core->bell().for_publishers())) {
      return false;
    }
  }
  message = {};
  message.kind = wire::MessageKind::kHandedBack;
  return hand_back(message);
}

void NodeCore::be_welcomed(wire::Received& welcome) {
  const std::lock_guard lock(mutex_);
  if (standing_ != Standing::kRejoining) return;
  turned_away_ = wire::find_fault_in_clock(welcome.message, asked_);
  if (!turned_away_.empty()) {
    // Once, though each time it is measured a little otherwise.
    if (!std::exchange(has_told_of_clock_, true)) note(NoticeKind::apart, 0, {}, turned_away_);
    be_alone(kTurnedAwayInterval);
    return;
  }
  has_told_of_clock_ = false;
  if (!shm::are_one_segment(welcome.descriptors[0], memory_->board())) {
    try {
      if (!has_no_ports_) throw std::runtime_error("the daemon has other memory");
      memory_ = std::make_shared<SharedMemory>(std::move(welcome.descriptors[0]),
                                               std::move(welcome.descriptors[1]), service_bell_,
                                               residence());
      ring_for_ended(service_bell_, shm::identity_of(memory_->board()), options_.service_thread);
    } catch (const std::exception& error) {
      turned_away_ = error.what();
      be_alone(kTurnedAwayInterval);
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
  news_.notify_all();
}

// The conversation is over; but the daemon may be replaced by one that knows us. It is told once,
// and not if a daemon merely has no descriptor to spare for a moment.
void NodeCore::be_turned_away(const wire::Message& refusal) {
  turned_away_ = refusal.text_view();
  if (++refusals_ == kToldRefusal) {
    note(NoticeKind::apart, 0, {},
         "components that come now do not see \"" + name_ +
             "\", which goes on with those that it is connected to: " + turned_away_);
  }
  be_alone(kTurnedAwayInterval);
}

}  // namespace arbiter::detail
