#include "gateway/core/outgoing.hpp"

namespace arbiter::gateway {
namespace {

InputPort<void> open(Node& node, const Entry& entry) {
  InputPortOptions options;
  options.depth = entry.queue;
  const Type type = type_of(entry);
  return type.is_untyped() ? node.input_port(entry.port->name, options)
                           : node.input_port(entry.port->name, type, options);
}

}  // namespace

Type type_of(const Entry& entry) {
  if (!entry.type) return Type::untyped(entry.max_size);
  if (entry.type->size == 0) return Type::variable(entry.type->name, entry.max_size);
  return {entry.type->name, entry.type->size, entry.type->alignment};
}

Outgoing::Outgoing(Node& node, const Entry& entry, Sender& sender, Account& account,
                   const AgesOfSources& ages)
    : entry_(entry), sender_(sender), account_(account), ages_(ages), port_(open(node, entry)) {}

void Outgoing::run(shm::Nanoseconds now) {
  // Other ports have their turn: a publisher that never rests must not keep the loop here.
  has_more_ = true;
  for (std::uint32_t i = 0; i < kMostAtOnce; ++i) {
    auto sample = port_.take();
    if (!sample) {
      has_more_ = false;
      break;
    }
    if (now - sample->stamp_ns() > ages_.of(sample->source())) {
      account_.late.add();
      continue;
    }
    send(**sample);
  }
  // Taken before the look at the port: a reader that comes in between is served the next time.
  const bool has_matched = matched_.exchange(false, std::memory_order_relaxed);
  if (!port_.idle()) {
    idle_again_.reset();
    return;
  }
  if (idle_again_ && now < *idle_again_ && !has_matched) return;
  idle_again_ = now + kIdlePeriod;
  if (entry_.idle.kind == Idle::Kind::kNothing) return;
  if (sender_.send({entry_.idle.sample.data(), entry_.idle.sample.size()}) ==
      Sender::Result::kSent) {
    account_.idle.add();
  }
}

shm::Nanoseconds Outgoing::next() const noexcept {
  if (has_more_) return 0;
  if (entry_.idle.kind == Idle::Kind::kNothing) return shm::kForever;
  return idle_again_.value_or(shm::kForever);
}

void Outgoing::send(Bytes sample) noexcept {
  switch (sender_.send(sample)) {
    case Sender::Result::kSent:
      account_.passed.add();
      account_.set_last_size(sample.size());
      return;
    case Sender::Result::kNotReady:
    case Sender::Result::kRefused:
      account_.refused.add();
      return;
    case Sender::Result::kNoMemory:
      account_.no_slot.add();
      return;
    case Sender::Result::kTooLarge:
      account_.too_large.add();
      return;
  }
}

}  // namespace arbiter::gateway
