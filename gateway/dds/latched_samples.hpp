// What was sent last to topics that keep it for those who come later. A writer of DDS forgets that
// when it is opened again, with a key or after an error, and when another mapping is taken up: the
// next one begins with it. It is forgotten when the process ends.
//
// Thread safety: one thread, the gateway's loop; a LastSample belongs to whoever has the writer.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "gateway/dds/payload.hpp"

namespace arbiter::gateway::dds {

// A reference of ours to what Cyclone has, or had; or, without operations, a payload that Cyclone
// never had: bytes that do not change any more.
struct GiveBack {
  void operator()(Payload* payload) const noexcept {
    if (payload->cyclone.ops == nullptr) return PayloadPool::of_process().give_back(payload);
    ddsi_serdata_unref(&payload->cyclone);
  }
};
using LastSample = std::unique_ptr<Payload, GiveBack>;

[[nodiscard]] inline LastSample keep(Payload& payload) noexcept {
  ddsi_serdata_ref(&payload.cyclone);
  return LastSample(&payload);
}

// From one mapping to the next, by what a writer is.
class LatchedSamples {
 public:
  void put(const std::string& writer, LastSample sample) {
    if (sample) samples_.insert_or_assign(writer, std::move(sample));
  }
  // Null: there is none.
  [[nodiscard]] LastSample take(const std::string& writer) {
    auto found = samples_.extract(writer);
    return found ? std::move(found.mapped()) : nullptr;
  }
  // What nobody has taken is of topics that the mapping has no more.
  void clear() noexcept { samples_.clear(); }

 private:
  std::map<std::string, LastSample> samples_;
};

}  // namespace arbiter::gateway::dds
