// An `in` entry's end in iceoryx: takes what waits in its queue, and says what is passed over.
//
// Thread safety: one thread, the session's.
#pragma once

#include <cstddef>
#include <optional>

#include "gateway/core/freshness.hpp"
#include "gateway/core/middleware.hpp"
#include "gateway/iceoryx/chunk.hpp"
#include "gateway/iceoryx/port_list.hpp"
#include "gateway/iceoryx/subscriber.hpp"

namespace arbiter::gateway {

class Inlet {
 public:
  // Keeps references. RouDi makes its subscriber.
  explicit Inlet(const Middleware::OpenIn& open);

  // As many as its queue holds: a publisher that never rests must not keep others waiting.
  void take_all();
  void count_publishers(const PortList& list) const;

  [[nodiscard]] Subscriber& subscriber() noexcept { return subscriber_; }
  [[nodiscard]] shm::Nanoseconds max_age() const noexcept { return in_.incoming.max_age().get(); }

 private:
  // Why a chunk is passed over.
  enum class Fault { kNone, kVersion, kOutside, kHeader, kTooLarge };
  [[nodiscard]] Fault fault_of(const Chunk& chunk);
  // `size`: what the sentence names.
  void tell(Fault fault, std::size_t size = 0);
  [[nodiscard]] std::string sentence(Fault fault, std::size_t size) const;

  const Middleware::OpenIn in_;
  const IceoryxTopic& topic_;
  Subscriber subscriber_;
  QueueFreshness freshness_;
  // Told last: whoever sends many bad chunks has one sentence made, and not one for each.
  Fault told_fault_ = Fault::kNone;
  std::size_t told_size_ = 0;
  bool has_overflown_ = false;
};

[[nodiscard]] iox::capro::ServiceDescription service_of(const IceoryxTopic& topic);

}  // namespace arbiter::gateway
