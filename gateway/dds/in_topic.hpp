// An `in` entry: what is published on a topic of DDS becomes arrivals at output ports.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "gateway/core/freshness.hpp"
#include "gateway/core/incoming.hpp"
#include "gateway/dds/arrived_sample.hpp"
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
  [[nodiscard]] std::string_view why_less_durable() const override;
  [[nodiscard]] std::uint32_t matched() const override;
  // On Cyclone's threads.
  void take(const Payload& payload, const SampleWriter& /*writer*/) noexcept override;
  // Why a sample is passed over.
  enum class Fault { kNone, kHeader, kSize, kEncoding, kField, kCut, kTooLarge };
  [[nodiscard]] Fault fault_of(const ArrivedSample& sample) const noexcept;
  [[nodiscard]] Fault fault_of(Incoming::Fate fate) const noexcept;
  void tell(Fault fault, std::size_t size) noexcept;
  [[nodiscard]] std::string sentence(Fault fault, std::size_t size) const;

  Incoming& incoming_;
  const StallGuard& guard_;
  const StallGuard::Watch& watch_;
  const Bell& bell_;
  // Told last: whoever sends many bad samples has one sentence made, and not one for each. Of
  // take(), which Cyclone calls for one sample at a time.
  Fault told_fault_ = Fault::kNone;
  std::size_t told_size_ = 0;
  ReaderCache cache_;
};

}  // namespace arbiter::gateway::dds
