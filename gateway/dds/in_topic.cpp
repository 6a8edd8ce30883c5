#include "gateway/dds/in_topic.hpp"

#include <chrono>
#include <string>
#include <utility>

#include "gateway/dds/arrived_sample.hpp"
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

std::uint32_t InTopic::matched() const {
  dds_subscription_matched_status_t status{};
  if (dds_get_subscription_matched_status(end().get(), &status) < 0) return 0;
  return status.current_count;
}

// Whatever waited for Cyclone's thread, such as datagrams in the socket while the process was
// stopped, comes through here: the guard knows how long that can have been.
void InTopic::take(const Payload& payload, const SampleWriter& /*writer*/) noexcept {
  const ArrivedSample sample(payload);
  const auto& choice = entry().choice;
  if (!sample.is_readable() || (choice && !sample.has_field_at(choice->offset))) {
    incoming_.fail();
    return;
  }
  const shm::Nanoseconds deadline = guard_.deadline(watch_, shm::monotonic_now());
  incoming_.deliver(sample, Time(std::chrono::nanoseconds(deadline)));
}

}  // namespace arbiter::gateway::dds
