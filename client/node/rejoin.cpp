// Losing the daemon, and coming back to another.
//
// All that data needs to flow is mapped already, so for the ports nothing changes. The next daemon
// is handed back the memory that the last one made, and told of each port and its links
// (service/takeover/takeover.hpp).
#include <sys/epoll.h>
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

// A port as it is handed back.
struct PortAtHand {
  wire::Message message;
  shm::FileDescriptor first;
  shm::FileDescriptor second;
  std::vector<HeldLink> links;
};

namespace {

// How often a daemon is looked for.
constexpr std::chrono::milliseconds kRejoinInterval{50};
// How long until it is tried again with a daemon that does not want us, or that has shown us what
// could not be taken up.
constexpr std::chrono::milliseconds kTurnedAwayInterval{1000};

// One comes each second.
constexpr int kToldRefusal = 3;

bool is_sent(const shm::FileDescriptor& socket, const wire::Message& message,
             std::array<int, wire::kMaxDescriptors> descriptors = {-1, -1}) {
  return wire::send_message(socket.get(), message, descriptors) == wire::SendResult::kSent;
}

// With descriptors of our own, for the port may be closed while it is on its way.
template <class Core>
PortAtHand port_at_hand(wire::MessageKind kind, const Core& core, std::uint32_t id,
                        const shm::FileDescriptor& second) {
  PortAtHand port;
  port.message.kind = kind;
  port.message.port = core.instance();
  port.message.id = id;
  port.message.type = core.type();
  port.message.set_name(core.name());
  port.first = shm::duplicate(core.segment_descriptor().get());
  port.second = shm::duplicate(second.get());
  port.links = core.held_links();
  return port;
}

bool is_handed_back(const shm::FileDescriptor& socket, const PortAtHand& port) {
  if (!is_sent(socket, port.message, {port.first.get(), port.second.get()})) return false;
  for (const HeldLink& link : port.links) {
    wire::Message message;
    message.kind = wire::MessageKind::kHandBackLink;
    message.port = port.message.port;
    message.peer = link.peer;
    message.link = link.number;
    if (!is_sent(socket, message)) return false;
  }
  return true;
}

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
  const auto socket = std::make_shared<const shm::FileDescriptor>(std::move(*found));
  std::vector<PortAtHand> ports;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [instance, core] : outputs_) {
      ports.push_back(port_at_hand(wire::MessageKind::kHandBackOutput, *core, core->source(),
                                   core->page_descriptor()));
      if (core->yields()) ports.back().message.flags = wire::kYields;
    }
    for (const auto& [instance, core] : inputs_) {
      core->set_measured(false);  // unless the next daemon says so
      ports.push_back(port_at_hand(wire::MessageKind::kHandBackInput, *core, core->port(),
                                   core->bell().for_publishers()));
    }
  }
  // What is handed back without its memory is lost: the daemon would give its name to another. So
  // it is kept for us, as for one that is stopped, until we come another time.
  const bool are_whole = std::all_of(
      ports.begin(), ports.end(), [](const PortAtHand& port) { return port.first && port.second; });
  if (!are_whole) {
    static_cast<void>(hand_back_memory(*socket, true));
    const std::lock_guard lock(mutex_);
    turned_away_ = wire::no_descriptor_left("its ports");
    ring_timer_every(kTurnedAwayInterval);
    return;
  }
  // Who has no ports left may be the last that has the memory, and with it what is active, and
  // which model is in force.
  has_no_ports_ = ports.empty();  // as asked_, of the thread that pumps alone
  asked_ = shm::monotonic_now();
  if (!hand_back(*socket, ports)) return;
  make_non_blocking(*socket);
  shm::close_in_children(*socket);
  const std::lock_guard lock(mutex_);
  socket_ = socket;
  if (!watch_socket()) {
    be_alone(kTurnedAwayInterval);
    return;
  }
  standing_ = Standing::kRejoining;
  ring_timer_every({});
  for (const PortAtHand& port : ports) {
    const shm::PortInstance instance = port.message.port;  // closed meanwhile?
    if (outputs_.count(instance) + inputs_.count(instance) == 0) say_closed(instance);
  }
}

bool NodeCore::hand_back_memory(const shm::FileDescriptor& socket, bool has_ports) const {
  wire::Message message = hello();
  message.flags |= wire::kRejoins | (has_ports ? 0u : wire::kHasNoPorts);
  if (!is_sent(socket, message, {memory_->board().get(), memory_->registry().get()})) return false;
  for (const auto& page : memory_->pages_at_hand()) {
    message = {};
    message.kind = wire::MessageKind::kHandBackPage;
    message.id = page.source;
    message.value = page.number;
    if (!is_sent(socket, message, {page.descriptor, -1})) return false;
  }
  return true;
}

bool NodeCore::hand_back(const shm::FileDescriptor& socket,
                         const std::vector<PortAtHand>& ports) const {
  if (!hand_back_memory(socket, !ports.empty())) return false;
  for (const PortAtHand& port : ports) {
    if (!is_handed_back(socket, port)) return false;
  }
  wire::Message message;
  message.kind = wire::MessageKind::kHandedBack;
  return is_sent(socket, message);
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
