// The compiled side of the public headers: from plain calls to the cores.
#include <arbiter/detail/cores.hpp>

#include "client/node_core.hpp"

namespace arbiter::detail {

std::shared_ptr<NodeCore> make_node(std::string_view name, const NodeOptions& options) {
  return std::make_shared<NodeCore>(name, options);
}
void service(NodeCore& node) { node.service(); }
int service_fd(const NodeCore& node) noexcept { return node.service_fd(); }
void switch_model(NodeCore& node, std::string_view name) {
  shm::Message question;
  question.kind = shm::MessageKind::kSwitch;
  question.set_name(name);  // one that is cut off is no model's
  node.ask(question, {-1, -1});
}

std::shared_ptr<OutputCore> open_output(NodeCore& node, std::string_view name, const PortType& type,
                                        const OutputPortOptions& options) {
  return node.open_output(name, type, options);
}
// Loans that are still out keep the core, but not the port.
void close_output(std::shared_ptr<OutputCore> core) noexcept {
  if (core == nullptr) return;
  core->node->close(core->instance());
  if (core->loans() != 0) core->kept_by_loans = core;
}
LoanedSlot loan(OutputCore& core, std::size_t size) noexcept { return core.loan(size); }
void end_loan(OutputCore& core, std::uint32_t slot) noexcept {
  core.end_loan(slot);
  std::shared_ptr<OutputCore> last;
  if (core.loans() == 0) last.swap(core.kept_by_loans);
}
Outcome publish(OutputCore& core, std::uint32_t slot, std::size_t size) noexcept {
  return core.publish_loan(slot, size, shm::monotonic_now());
}
Outcome publish_copy(OutputCore& core, const void* data, std::size_t size) noexcept {
  return core.publish_copy(data, size, shm::monotonic_now());
}
Outcome signal(OutputCore& core) noexcept { return core.signal(shm::monotonic_now()); }
void deactivate(OutputCore& core) noexcept { core.deactivate(shm::monotonic_now()); }
std::size_t max_size(const OutputCore& core) noexcept { return core.type().size; }
const std::string& name(const OutputCore& core) noexcept { return core.name(); }

std::shared_ptr<InputCore> open_input(NodeCore& node, std::string_view name, const PortType& type,
                                      const InputPortOptions& options) {
  return node.open_input(name, type, options);
}
// While samples are held their memory must stay announced as held, so the port closes after them.
void close_input(std::shared_ptr<InputCore> core) noexcept {
  if (core == nullptr) return;
  if (core->held() != 0) {
    core->kept_by_samples = core;
  } else {
    core->node->close(core->instance());
  }
}
HeldSample take(InputCore& core) { return core.take(); }
Waited wait(InputCore& core, std::int64_t timeout_ns, HeldSample& sample) {
  return core.wait(timeout_ns, sample);
}
void give_back(InputCore& core, std::uint32_t hold) noexcept {
  core.give_back(hold);
  if (core.kept_by_samples != nullptr && core.held() == 0) {
    close_input(std::move(core.kept_by_samples));
  }
}
int wait_descriptor(InputCore& core) { return core.wait_descriptor(); }
std::optional<std::string_view> winner(InputCore& core) noexcept { return core.winner(); }
bool is_idle(InputCore& core) noexcept { return core.is_idle(); }
const std::string& source_name(const InputCore& core, std::uint32_t source) noexcept {
  return core.memory().source_name(source);
}
const std::string& name(const InputCore& core) noexcept { return core.name(); }

}  // namespace arbiter::detail
