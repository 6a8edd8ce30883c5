// An `in` entry: what is published on a topic of DDS becomes arrivals at output ports.
#pragma once

#include "gateway/core/freshness.hpp"
#include "gateway/core/incoming.hpp"
#include "gateway/dds/end_point.hpp"
#include "gateway/dds/reader_cache.hpp"

namespace arbiter::gateway::dds {

class InTopic : public EndPoint, private SampleTaker {
 public:
  // Keeps references. `bell`: rings where a publisher has come or gone.
  InTopic(Incoming& incoming, Account& account, StallGuard& guard, const Bell& bell);
  ~InTopic() override { close(); }

 private:
  Entity make(dds_entity_t participant, dds_entity_t topic, const ddsi_sertype* type,
              const dds_qos_t* qos) override;
  // Samples from before it came are old: they may be arrivals only where T is forever.
  [[nodiscard]] Durability durability() const override;
  [[nodiscard]] std::uint32_t matched() const override;
  // On Cyclone's threads.
  void take(const Payload& payload, const SampleWriter& /*writer*/) noexcept override;

  Incoming& incoming_;
  const StallGuard& guard_;
  const StallGuard::Watch& watch_;
  const Bell& bell_;
  ReaderCache cache_;
};

}  // namespace arbiter::gateway::dds
