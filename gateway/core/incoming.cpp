#include "gateway/core/incoming.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#include "gateway/core/outgoing.hpp"

namespace arbiter::gateway {
namespace {

template <class Number>
std::optional<Side> compare(const Choice& choice, const std::byte* bytes) noexcept {
  Number number;
  std::memcpy(&number, bytes, sizeof number);
  if constexpr (std::is_floating_point_v<Number>) {
    if (std::isnan(number)) return {};
    // The threshold as the sample would have it: a float of 0.1 is not above 0.1.
    return number > static_cast<Number>(choice.threshold) ? Side::kYes : Side::kNo;
  }
  return static_cast<long double>(number) > choice.threshold ? Side::kYes : Side::kNo;
}

Time later(Time time, shm::Nanoseconds by) noexcept {
  const std::chrono::nanoseconds more(by);
  return time > Time::max() - more ? Time::max() : time + more;
}

OutputPort<void> open(Node& node, const std::string& name, const Entry& entry) {
  OutputPortOptions options;
  options.max_size = entry.max_size;
  options.max_loans = 1;
  const Type type = type_of(entry);
  return type.is_untyped() ? node.output_port(name, options)
                           : node.output_port(name, type, options);
}

bool has_one_size(const Entry& entry) noexcept { return entry.type && entry.type->size != 0; }

}  // namespace

std::string does_not_fit(const Entry& entry, std::size_t bytes) {
  return "the last bad sample has " + std::to_string(bytes) +
         (bytes == 1 ? " byte; " : " bytes; ") +
         (has_one_size(entry) ? entry.type->name + " has " + std::to_string(entry.type->size)
                              : "max_size is " + std::to_string(entry.max_size));
}

std::optional<Side> choose(const Choice& choice, const ForeignSample& sample) noexcept {
  std::byte bytes[8];
  const std::size_t size = size_of(choice.field);
  const std::size_t begin = sample.data_begin();
  const std::size_t whole = sample.size();
  if (begin > whole || choice.offset > whole - begin || size > whole - begin - choice.offset) {
    return {};
  }
  if (!sample.copy(begin + choice.offset, {bytes, size})) return {};
  if (sample.is_big_endian() == (std::endian::native == std::endian::little)) {
    std::reverse(bytes, bytes + size);
  }
  switch (choice.field) {
    case Field::kBoolean:
      if (bytes[0] > std::byte{1}) return {};
      return bytes[0] == std::byte{1} ? Side::kYes : Side::kNo;
    case Field::kI8:
      return compare<std::int8_t>(choice, bytes);
    case Field::kU8:
      return compare<std::uint8_t>(choice, bytes);
    case Field::kI16:
      return compare<std::int16_t>(choice, bytes);
    case Field::kU16:
      return compare<std::uint16_t>(choice, bytes);
    case Field::kI32:
      return compare<std::int32_t>(choice, bytes);
    case Field::kU32:
      return compare<std::uint32_t>(choice, bytes);
    case Field::kI64:
      return compare<std::int64_t>(choice, bytes);
    case Field::kU64:
      return compare<std::uint64_t>(choice, bytes);
    case Field::kF32:
      return compare<float>(choice, bytes);
    case Field::kF64:
      break;
  }
  return compare<double>(choice, bytes);
}

Incoming::Incoming(Node& node, const Entry& entry, Account& account, std::size_t* first)
    : feed_(entry), account_(account) {
  const auto ports = entry.ports();
  const std::size_t begin = first == nullptr ? 0 : *first;
  for (std::size_t tried = 0; tried < ports.size(); ++tried) {
    const std::size_t at = (begin + tried) % ports.size();
    if (first != nullptr) *first = at;
    port_of(*ports[at]).emplace(open(node, ports[at]->name, entry));
  }
}

std::optional<OutputPort<void>>& Incoming::port_of(const Port& port) noexcept {
  const bool is_no = entry().choice && entry().choice->no && &port == &*entry().choice->no;
  return is_no ? no_ : yes_;
}

// publish() throws for another port's loan, which it never is.
// NOLINTNEXTLINE(bugprone-exception-escape)
Incoming::Fate Incoming::deliver(const ForeignSample& sample, Time deadline) noexcept {
  if (!entry().choice) return pass_on(sample, deadline);
  // What cannot be of the entry's type has no field of it.
  if (has_one_size(entry()) && sample.size() != entry().type->size) {
    account_.too_large.add();
    deactivate_all();
    return Fate::kTooLarge;
  }
  const auto side = choose(*entry().choice, sample);
  if (!side) {
    fail();
    return Fate::kUnreadable;
  }
  auto& chosen = *side == Side::kYes ? yes_ : no_;
  auto& other = *side == Side::kYes ? no_ : yes_;
  Fate fate = Fate::kPassed;
  if (chosen) {
    const std::size_t number = *side == Side::kYes ? 0 : 1;
    fate = pass_to(*chosen, sample, later(deadline, max_age_.more_of(number)));
  } else {
    account_.passed.add();
    account_.set_last_size(sample.size());
  }
  // Whatever has become of it: the topic's last word is not the other side. A late one makes
  // nothing active, but deactivations are never late.
  if (other) other->deactivate();
  if (fate == Fate::kUnreadable) chosen->deactivate();
  return fate;
}

// As above. NOLINTNEXTLINE(bugprone-exception-escape)
Incoming::Fate Incoming::pass_on(const ForeignSample& sample, Time deadline) noexcept {
  Outgoing* const outgoing = feed_.outgoing();
  if (outgoing == nullptr || !outgoing->begin_turn(sample.size())) {
    return pass_to(*yes_, sample, deadline);
  }
  const Fate fate = pass_to(*yes_, sample, deadline, outgoing);
  // A source that has lost would only hold up the others.
  if (!outgoing->end_turn(yes_->name(), max_age_.get())) {
    feed_.withdraw();
  }
  return fate;
}

// As above. NOLINTNEXTLINE(bugprone-exception-escape)
Incoming::Fate Incoming::pass_to(OutputPort<void>& port, const ForeignSample& sample, Time deadline,
                                 Outgoing* outgoing) noexcept {
  const std::size_t size = sample.size();
  const bool fits = port.type().has_one_size() ? size == port.max_size() : size <= port.max_size();
  if (!fits) {
    account_.too_large.add();
    return Fate::kTooLarge;
  }
  auto loan = port.loan(size);
  if (!loan) {  // it did arrive, as when publish() has no memory for a copy
    if (port.signal(deadline).late) {
      account_.late.add();
      return Fate::kLate;
    }
    account_.no_slot.add();
    return Fate::kNoSlot;
  }
  const WritableBytes draft = outgoing == nullptr ? WritableBytes() : outgoing->draft(size);
  if (!sample.copy(0, draft.empty() ? WritableBytes(loan->data(), size) : draft)) {
    account_.unreadable.add();
    return Fate::kUnreadable;
  }
  const bool is_late = draft.empty() ? port.publish(std::move(*loan), deadline).late
                                     : outgoing->publish_draft(port, std::move(*loan), deadline);
  if (is_late) {
    account_.late.add();
    return Fate::kLate;
  }
  account_.passed.add();
  account_.set_last_size(size);
  return Fate::kPassed;
}

void Incoming::fail() noexcept {
  account_.unreadable.add();
  if (entry().choice) deactivate_all();
}

void Incoming::deactivate_all() noexcept {
  if (yes_) yes_->deactivate();
  if (no_) no_->deactivate();
}

void Incoming::describe(std::string_view text, bool is_trouble) {
  for (auto* const port : {&yes_, &no_}) {
    if (!*port) continue;
    is_trouble ? (*port)->describe_trouble(text) : (*port)->describe(text);
  }
}

}  // namespace arbiter::gateway
