// Who waits for a status document: it is made once for all, and never for more than a part of the
// daemon's time.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "service/clients/client.hpp"
#include "shm/activity.hpp"

namespace arbiter::service {

class StatusRequests {
 public:
  struct Asking {
    ClientId client = 0;
    std::uint64_t request = 0;
  };

  // Throws LimitExceeded where the client has asked too often without waiting for the answer.
  void add(Client& client, std::uint64_t request) {
    if (client.waits_for_status == kMaxAtOnce) {
      throw LimitExceeded("limit-exceeded: " + std::to_string(kMaxAtOnce) +
                          " status documents have been asked for that are not answered yet: wait "
                          "for them");
    }
    ++client.waits_for_status;
    asking_.push_back({client.id(), request});
  }

  // When the next document is due; kForever: nobody waits.
  [[nodiscard]] shm::Nanoseconds next() const { return asking_.empty() ? shm::kForever : due_; }
  [[nodiscard]] bool are_due(shm::Nanoseconds now) const { return now >= next(); }
  [[nodiscard]] std::vector<Asking> take() { return std::exchange(asking_, {}); }
  // One was made from then until now. Others come first for three times as long.
  void made(shm::Nanoseconds begin, shm::Nanoseconds end) { due_ = end + 3 * (end - begin); }

 private:
  static constexpr std::uint32_t kMaxAtOnce = 64;

  std::vector<Asking> asking_;
  shm::Nanoseconds due_ = 0;
};

}  // namespace arbiter::service
