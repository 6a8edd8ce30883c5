// The compiled side of the public headers: from plain calls to the cores. Here it is seen whether
// the caller is the process that made them (client/calls/foreign.hpp).
#include <algorithm>

#include <arbiter/detail/cores.hpp>

#include "client/calls/foreign.hpp"
#include "client/node/node_core.hpp"
#include "shm/assertion.hpp"

namespace arbiter::detail {
namespace {

shm::Nanoseconds nanoseconds(Time time) noexcept { return time.time_since_epoch().count(); }

void begin_replay(OutputCore& core, Time at) {
  require_own(core);
  core.begin_replay(nanoseconds(at), shm::monotonic_now());
}

}  // namespace

std::shared_ptr<NodeCore> make_node(std::string_view name, const NodeOptions& options) {
  return std::make_shared<NodeCore>(name, options);
}
void drop_node(std::shared_ptr<NodeCore> node) noexcept {
  if (node != nullptr && !node->process().is_surely_here()) keep_for_ever(std::move(node));
}
void service(NodeCore& node) {
  require_own(node);
  node.service();
}
int service_fd(const NodeCore& node) noexcept {
  return node.process().is_here() ? node.service_fd() : -1;
}
void switch_model(NodeCore& node, std::string_view name) {
  require_own(node);
  wire::Message question;
  question.kind = wire::MessageKind::kSwitch;
  question.set_name(name);
  if (question.name_view() != name) question.set_name({});  // it was cut off: no model has it
  node.ask(question, {-1, -1});
}

std::shared_ptr<OutputCore> open_output(NodeCore& node, std::string_view name, const Type& type,
                                        const OutputPortOptions& options) {
  require_own(node);
  return node.open_output(name, type, options);
}
// Loans that are still out keep the core, but not the port.
void close_output(std::shared_ptr<OutputCore> core) noexcept {
  if (core == nullptr) return;
  if (!core->process.is_surely_here()) return keep_for_ever(std::move(core));
  core->node->close(*core);
  if (core->loans() != 0) core->kept_by_loans = core;
}
LoanedSlot loan(OutputCore& core, std::size_t size) noexcept {
  return is_own(core) ? core.loan(size) : LoanedSlot{};
}
void end_loan(OutputCore& core, std::uint32_t slot) noexcept {
  if (!core.process.is_here()) return;
  ARBITER_ASSERT(core.loans() != 0, "a loan ends twice");
  core.end_loan(slot);
  std::shared_ptr<OutputCore> last;
  if (core.loans() == 0) last.swap(core.kept_by_loans);
}
Counts publish(OutputCore& core, std::uint32_t slot, std::size_t size) noexcept {
  return is_own(core) ? core.publish_loan(slot, size, shm::monotonic_now()) : Counts{};
}
Counts publish_copy(OutputCore& core, const void* data, std::size_t size) noexcept {
  return is_own(core) ? core.publish_copy(data, size, shm::monotonic_now()) : Counts{};
}
Counts signal(OutputCore& core) noexcept {
  return is_own(core) ? core.signal(shm::monotonic_now()) : Counts{};
}
Outcome publish(OutputCore& core, std::uint32_t slot, std::size_t size, Time deadline) noexcept {
  if (!is_own(core)) return {};
  return core.publish_loan_by(nanoseconds(deadline), slot, size, shm::monotonic_now());
}
Outcome publish_copy(OutputCore& core, const void* data, std::size_t size, Time deadline) noexcept {
  if (!is_own(core)) return {};
  return core.publish_copy_by(nanoseconds(deadline), data, size, shm::monotonic_now());
}
Outcome signal(OutputCore& core, Time deadline) noexcept {
  return is_own(core) ? core.signal_by(nanoseconds(deadline), shm::monotonic_now()) : Outcome{};
}
Outcome publish(OutputCore& core, std::uint32_t slot, std::size_t size, Time deadline,
                Origin origin) noexcept {
  if (!is_own(core)) return {};
  return core.pass_on_loan({origin.publisher, origin.sequence}, nanoseconds(deadline), slot, size,
                           shm::monotonic_now());
}
Outcome signal(OutputCore& core, Time deadline, Origin origin) noexcept {
  if (!is_own(core)) return {};
  return core.pass_on_signal({origin.publisher, origin.sequence}, nanoseconds(deadline),
                             shm::monotonic_now());
}
Published publish(OutputCore& core, std::uint32_t slot, std::size_t size, Time deadline,
                  const LateBytes& bytes) noexcept {
  if (!is_own(core)) return {};
  // Another node's may be another daemon's, which numbers its ports as this one does.
  const bool is_here = bytes.knower->node == core.node;
  return core.publish_late_bytes(bytes, is_here ? bytes.knower->instance() : 0,
                                 nanoseconds(deadline), slot, size, shm::monotonic_now());
}
Outcome publish_signalled(OutputCore& core, std::uint32_t slot, std::size_t size, Time deadline,
                          Origin origin) noexcept {
  if (!is_own(core)) return {};
  return core.publish_signalled({origin.publisher, origin.sequence}, nanoseconds(deadline), slot,
                                size, shm::monotonic_now());
}
bool wants_samples(const OutputCore& core) noexcept { return is_own(core) && core.wants_samples(); }
void deactivate(OutputCore& core) noexcept {
  if (is_own(core)) core.deactivate(shm::monotonic_now());
}
Counts publish_at(OutputCore& core, Time at, std::uint32_t slot, std::size_t size) {
  LoanedBy loan(&core, {slot});  // given back where this is refused
  begin_replay(core, at);
  static_cast<void>(loan.release());
  const Counts counts = core.publish_loan(slot, size, nanoseconds(at));
  core.end_replay();
  return counts;
}
Counts publish_copy_at(OutputCore& core, Time at, const void* data, std::size_t size) {
  begin_replay(core, at);
  const Counts counts = core.publish_copy(data, size, nanoseconds(at));
  core.end_replay();
  return counts;
}
Counts signal_at(OutputCore& core, Time at) {
  begin_replay(core, at);
  const Counts counts = core.signal(nanoseconds(at));
  core.end_replay();
  return counts;
}
void require_replay(const OutputCore& core) { core.require_replay(); }
void deactivate_at(OutputCore& core, Time at) {
  begin_replay(core, at);
  core.deactivate(nanoseconds(at));
  core.end_replay();
}
void describe(OutputCore& core, std::string_view text, bool is_trouble) noexcept {
  if (is_own(core)) core.node->describe(core.instance(), text, is_trouble);
}
bool asked_to_yield(const OutputCore& core) noexcept { return core.asked_to_yield(); }
std::size_t max_size(const OutputCore& core) noexcept { return core.type().size; }
const std::string& name(const OutputCore& core) noexcept { return core.name(); }
const Type& type(const OutputCore& core) noexcept { return core.declared_type(); }

std::shared_ptr<InputCore> open_input(NodeCore& node, std::string_view name, const Type& type,
                                      const InputPortOptions& options) {
  require_own(node);
  return node.open_input(name, type, options);
}
// While samples are held their memory must stay announced as held, so the port closes after them.
void close_input(std::shared_ptr<InputCore> core) noexcept {
  if (core == nullptr) return;
  if (!core->process.is_surely_here()) return keep_for_ever(std::move(core));
  if (core->held() != 0) {
    core->kept_by_samples = core;
  } else {
    core->node->close(*core);
  }
}
HeldSample take(InputCore& core) {
  require_own(core);
  return core.take();
}
Waited wait(InputCore& core, std::int64_t timeout_ns, HeldSample& sample) {
  require_own(core);
  return core.wait(timeout_ns, sample);
}
void give_back(InputCore& core, std::uint32_t hold) noexcept {
  if (!core.process.is_here()) return;
  core.give_back(hold);
  if (core.kept_by_samples != nullptr && core.held() == 0) {
    close_input(std::move(core.kept_by_samples));
  }
}
void disarm(InputCore& core) noexcept {
  if (is_own(core)) core.disarm_descriptor();
}
int wait_descriptor(InputCore& core) {
  require_own(core);
  return core.wait_descriptor();
}
void describe(InputCore& core, std::string_view text, bool is_trouble) noexcept {
  if (is_own(core)) core.node->describe(core.instance(), text, is_trouble);
}
std::optional<std::string_view> winner(InputCore& core) noexcept {
  if (!is_own(core)) return {};
  return core.winner();
}
// A child commands nothing: what it would drive it must stop.
bool is_idle(InputCore& core) noexcept { return !is_own(core) || core.is_idle(); }
const std::string& source_name(const InputCore& core, std::uint32_t source) noexcept {
  return core.memory().source_name(source);
}
const Type& sample_type(const InputCore& core, std::uint32_t hold) noexcept {
  return core.type_of_held(hold);
}
Origin sample_origin(const InputCore& core, const HeldSample& held) noexcept {
  const shm::SampleOrigin origin = core.origin_of(held);
  return {origin.publisher, origin.sequence};
}

std::shared_ptr<TapCore> open_tap(NodeCore& node, std::string_view name, const Type& type,
                                  const TapOptions& options) {
  require_own(node);
  return node.open_tap(name, type, options);
}
// While events with samples are kept the samples must stay announced as held: the tap closes after
// them.
void close_tap(std::shared_ptr<TapCore> core) noexcept {
  if (core == nullptr) return;
  if (!core->process.is_surely_here()) return keep_for_ever(std::move(core));
  if (core->held() != 0) {
    core->kept_by_events = core;
  } else {
    core->node->close(*core);
  }
}
bool take(TapCore& core, TapEventData& event) {
  require_own(core);
  return core.take(event);
}
bool wait(TapCore& core, std::int64_t timeout_ns, TapEventData& event) {
  require_own(core);
  return core.wait(timeout_ns, event);
}
void give_back(TapCore& core, std::uint32_t hold) noexcept {
  if (!core.process.is_here()) return;
  core.give_back(hold);
  if (core.kept_by_events != nullptr && core.held() == 0) {
    close_tap(std::move(core.kept_by_events));
  }
}
int wait_descriptor(TapCore& core) {
  require_own(core);
  return core.wait_descriptor();
}
const std::string& name(const TapCore& core) noexcept { return core.name(); }
std::uint64_t lost_events(const TapCore& core) noexcept { return core.lost_events(); }
std::uint64_t lost_samples(const TapCore& core) noexcept { return core.lost_samples(); }
Latencies latencies(TapCore& core) { return is_own(core) ? core.latencies() : Latencies(); }

// A publisher that lies, or whose memory is damaged, must not keep a motor from stopping, nor make
// an age overflow.
std::int64_t believable_time(std::int64_t stamp_ns) noexcept {
  return std::clamp<std::int64_t>(stamp_ns, 0, shm::monotonic_now());
}
const std::string& name(const InputCore& core) noexcept { return core.name(); }
const Type& type(const InputCore& core) noexcept { return core.declared_type(); }

}  // namespace arbiter::detail
