// An `out` entry: what an input port takes is published on a topic of DDS.
#pragma once

#include <atomic>
#include <cstddef>

#include "gateway/core/bridge.hpp"
#include "gateway/core/outgoing.hpp"
#include "gateway/dds/end_point.hpp"
#include "gateway/dds/payload.hpp"

namespace arbiter::gateway::dds {

class OutTopic : public EndPoint, public Sender {
 public:
  // What Cyclone's receiving thread sends itself. It reads no datagram meanwhile, of no topic, and
  // an emergency stop may be next: 64 KiB take half a millisecond at 1 Gbit/s, but 8 MiB would take
  // 65 ms, in which the socket's buffer overflows.
  static constexpr std::size_t kLargestAtOnce = kEncapsulationBytes + (std::size_t{64} << 10);

  // Keeps references.
  OutTopic(const Entry& entry, Account& account, const Bell& bell);
  ~OutTopic() override { close(); }

  // Who is told of each reader that comes; null: nobody any more.
  void tell(Outgoing* outgoing) noexcept { outgoing_.store(outgoing, std::memory_order_relaxed); }

  // Waits a little for subscribers that do not keep up. The gateway's loop.
  [[nodiscard]] Result send(Bytes sample) noexcept override;
  [[nodiscard]] Result send_at_once(Bytes sample) noexcept override;
  [[nodiscard]] std::size_t largest_at_once() const noexcept override { return kLargestAtOnce; }

 private:
  Entity make(dds_entity_t participant, dds_entity_t topic, const ddsi_sertype* type,
              const dds_qos_t* qos) override;
  [[nodiscard]] std::uint32_t matched() const override;
  // On Cyclone's threads.
  void on_matched(const dds_publication_matched_status_t& status) noexcept;
  Result refuse(const std::string& why) noexcept;

  const Bell& bell_;
  const Representation representation_;
  const ddsi_sertype* type_ = nullptr;
  // Relaxed is enough: what it points to was made before the writer whose making starts the calls,
  // and outlives it.
  std::atomic<Outgoing*> outgoing_{nullptr};
};

}  // namespace arbiter::gateway::dds
