// How a node opens its ports and its taps, and closes them.
#include <exception>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>

#include "client/node/names.hpp"
#include "client/node/node_core.hpp"
#include "client/types.hpp"

namespace arbiter::detail {
namespace {

// The most that max_memory may be: a segment has queues and headers beside the samples.
constexpr std::size_t kMostMemory = shm::kMaxSegmentSize - (std::size_t{16} << 20);

template <class Value>
void check_bounds(std::string_view port, const char* option, Value value, Value least, Value most) {
  if (value >= least && value <= most) return;
  throw Error(std::string(port) + ": " + option + " is " + std::to_string(value) +
              ", but must be from " + std::to_string(least) + " to " + std::to_string(most));
}

wire::Message message_of(wire::MessageKind kind, std::string_view name = {}) {
  wire::Message message;
  message.kind = kind;
  message.set_name(name);
  return message;
}

}  // namespace

template <class Make>
auto NodeCore::open(std::string_view name, Make make) {
  for (;;) {
    try {
      return make(memory());
    } catch (const MemoryIsNew&) {  // the next one is made for it
    } catch (const ThrownByCallback& callback) {
      std::rethrow_exception(callback.thrown);
    } catch (const std::system_error& error) {
      throw Error(std::string(name) + ": " + error.what());
    }
  }
}

std::shared_ptr<OutputCore> NodeCore::open_output(std::string_view name, const Type& type,
                                                  const OutputPortOptions& options) {
  check_port_name(name);
  check_bounds<std::uint32_t>(name, "max_loans", options.max_loans, 1, shm::kMaxLoans);
  check_bounds<std::size_t>(name, "max_size", type.size(), 0, std::size_t{shm::kMaxTypeSize});
  const std::size_t least = OutputCore::least_memory(as_info(type), options.max_loans);
  if (least > kMostMemory) {
    throw Error(std::string(name) + ": its samples need a max_memory of " + std::to_string(least) +
                ", which is above the bound " + std::to_string(kMostMemory));
  }
  check_bounds<std::size_t>(name, "max_memory", options.max_memory, least, kMostMemory);
  return open(name, [&](const std::shared_ptr<SharedMemory>& memory) {
    auto core = std::make_shared<OutputCore>(std::string(name), type, options, memory);
    core->node = shared_from_this();
    core->process = process_;
    wire::Message question = message_of(wire::MessageKind::kOpenOutput, name);
    question.type = core->type();
    question.flags = options.yields ? wire::kYields : 0u;
    converse(question, {core->segment_descriptor().get(), -1}, memory.get(),
             [&](wire::Received& opened) {
               const wire::Message& said = opened.message;
               if ((said.flags & wire::kMayReplay) == 0) {
                 core->forbid_replay(std::string(said.text_view()));
               }
               core->bind(said.port, said.id, std::move(opened.descriptors[0]));
               outputs_[opened.message.port] = core;
             });
    return core;
  });
}

std::shared_ptr<InputCore> NodeCore::open_input(std::string_view name, const Type& type,
                                                const InputPortOptions& options) {
  check_port_name(name);
  check_bounds<std::uint32_t>(name, "depth", options.depth, 1, shm::kMaxDepth);
  check_bounds<std::uint32_t>(name, "max_held", options.max_held, 1, shm::kMaxHeld);
  check_bounds<unsigned>(name, "when_full", static_cast<unsigned>(options.when_full), 0, 1);
  return open(name, [&](const std::shared_ptr<SharedMemory>& memory) {
    auto core = std::make_shared<InputCore>(std::string(name), type, options, memory);
    core->node = shared_from_this();
    core->process = process_;
    wire::Message question = message_of(wire::MessageKind::kOpenInput, name);
    question.type = core->type();
    converse(question, {core->segment_descriptor().get(), core->bell().for_publishers().get()},
             memory.get(), [&](wire::Received& opened) {
               core->bind(opened.message.port, opened.message.id);
               inputs_[opened.message.port] = core;
             });
    return core;
  });
}

std::shared_ptr<TapCore> NodeCore::open_tap(std::string_view name, const Type& type,
                                            const TapOptions& options) {
  check_port_name(name);
  check_bounds<std::uint32_t>(name, "max_held", options.max_held, 0, shm::kMaxTapHeld);
  check_bounds<unsigned>(name, "of", static_cast<unsigned>(options.of), 0, 1);
  return open(name, [&](const std::shared_ptr<SharedMemory>&) {
    auto core =
        std::make_shared<TapCore>(std::string(name), type, options, service_bell_, residence());
    core->node = shared_from_this();
    core->process = process_;
    wire::Message question = message_of(wire::MessageKind::kOpenTap, name);
    question.flags = options.of == TapOf::input ? wire::kTapsInput : 0u;
    try {
      converse(question, {core->segment_descriptor().get(), core->bell().for_publishers().get()},
               nullptr, [&](wire::Received& opened) {
                 taps_.erase(core->instance());  // that another daemon has opened
                 core->bind(opened.message.port);
                 taps_[opened.message.port] = core;
               });
    } catch (...) {
      const std::lock_guard lock(mutex_);
      std::erase_if(taps_, [&](const auto& each) { return each.second == core; });
      throw;
    }
    return core;
  });
}

template <class Core>
void NodeCore::close(const Core& core) noexcept {
  const auto close_among = [&](auto& ports) {
    decltype(ports.extract(ports.begin())) closed;  // destroyed after the lock is released
    const std::lock_guard lock(mutex_);
    const shm::PortInstance port = core.instance();
    closed = ports.extract(port);
    given_.erase(port);
    descriptions_.erase(port);
    say_closed(port);
  };
  if constexpr (std::is_same_v<Core, OutputCore>) close_among(outputs_);
  if constexpr (std::is_same_v<Core, InputCore>) close_among(inputs_);
  if constexpr (std::is_same_v<Core, TapCore>) close_among(taps_);
}

template void NodeCore::close(const OutputCore& core) noexcept;
template void NodeCore::close(const InputCore& core) noexcept;
template void NodeCore::close(const TapCore& core) noexcept;

}  // namespace arbiter::detail
