#include "gateway/dds/in_topic.hpp"

#include <chrono>
#include <utility>

#include "shm/clock.hpp"

namespace arbiter::gateway::dds {

InTopic::InTopic(Incoming& incoming, Account& account, StallGuard& guard, const Bell& bell)
    : EndPoint(End::kReader, incoming.entry(), account),
      incoming_(incoming),
      guard_(guard),
      watch_(guard.add(incoming.max_age())),
      bell_(bell),
      cache_(*this) {}

Entity InTopic::make(dds_entity_t participant, dds_entity_t topic, const ddsi_sertype* /*type*/,
                     const dds_qos_t* qos) {
  const Listener listener(dds_create_listener(const_cast<Bell*>(&bell_)));
  dds_lset_subscription_matched(
      listener.get(),
      [](dds_entity_t /*reader*/, const dds_subscription_matched_status_t /*status*/, void* bell) {
        static_cast<const Bell*>(bell)->ring();
      });
  return {dds_create_reader_rhc(participant, topic, qos, listener.get(), cache_.cache()),
          "a reader of " + this->topic().name};
}

Durability InTopic::durability() const {
  return std::as_const(incoming_).max_age().is_forever() ? EndPoint::durability()
                                                         : Durability::kVolatile;
}

std::string_view InTopic::why_less_durable() const {
  if (durability() == EndPoint::durability()) return {};
  if (entry().max_age) return "the entry has a max_age";
  return std::as_const(incoming_).max_age().is_known() ? "T is not forever" : "T is not known";
}

std::uint32_t InTopic::matched() const {
  dds_subscription_matched_status_t status{};
  if (dds_get_subscription_matched_status(end().get(), &status) < 0) return 0;
  return status.current_count;
}

// Whatever waited for Cyclone's thread, such as datagrams in the socket while the process was
// stopped, comes through here: the guard knows how long that can have been.
void InTopic::take(const Payload& payload, const SampleWriter& /*writer*/) noexcept {
  const ArrivedSample sample(payload);
  Fault fault = fault_of(sample);
  if (fault != Fault::kNone) {
    incoming_.fail();
  } else {
    const shm::Nanoseconds deadline = guard_.deadline(watch_, shm::monotonic_now());
    fault = fault_of(incoming_.deliver(sample, Time(std::chrono::nanoseconds(deadline))));
  }
  if (fault != Fault::kNone) tell(fault, sample.size());
}

// What cannot be of the entry's type must not win: whoever obeys the topic would drop it, and go on
// with the last command.
InTopic::Fault InTopic::fault_of(const ArrivedSample& sample) const noexcept {
  if (!sample.is_readable()) return Fault::kHeader;
  if (const auto& size = topic().size; size && !sample.may_have(*size)) return Fault::kSize;
  const auto& choice = entry().choice;
  if (!choice) return Fault::kNone;
  if (!sample.has_field_at(choice->offset)) return Fault::kEncoding;
  return sample.reaches(choice->offset + size_of(choice->field)) ? Fault::kNone : Fault::kField;
}

InTopic::Fault InTopic::fault_of(Incoming::Fate fate) const noexcept {
  if (fate == Incoming::Fate::kTooLarge) return Fault::kTooLarge;
  if (fate != Incoming::Fate::kUnreadable) return Fault::kNone;
  return entry().choice ? Fault::kField : Fault::kCut;
}

void InTopic::tell(Fault fault, std::size_t size) noexcept {
  if (fault == told_fault_ && size == told_size_) return;
  told_fault_ = fault;
  told_size_ = size;
  account().set_last_reason(sentence(fault, size));
}

std::string InTopic::sentence(Fault fault, std::size_t size) const {
  switch (fault) {
    case Fault::kNone:
      return "";
    case Fault::kHeader:
      return "the last bad sample does not begin with an encapsulation header of DDS";
    case Fault::kSize:
      return wrong_size(size);
    case Fault::kEncoding:
      return "the last bad sample is encoded so that its field may stand elsewhere";
    case Fault::kField:
      return "the field of the last bad sample chooses neither source";
    case Fault::kCut:
      return "the last bad sample is not whole";
    case Fault::kTooLarge:
      break;
  }
  return does_not_fit(entry(), size);
}

}  // namespace arbiter::gateway::dds
