// The ports that components asked for last and were refused, for the status document: a component
// that may not open a port is not to be seen otherwise, and whoever misses it does not look into
// its log.
#pragma once

#include <deque>
#include <string>

#include "service/clients/client.hpp"
#include "shm/clock.hpp"
#include "wire/status.hpp"

namespace arbiter::service {

class Refusals {
 public:
  static constexpr std::size_t kMost = 64;
  // So that one user cannot push out what concerns all others.
  static constexpr std::size_t kMostOfUser = 16;

  enum class End { kOutput, kInput };

  // `port`: a name that has passed for one. False: this process was refused it before, for the same
  // reason; it tries again and again.
  bool note(const Client& client, End end, const std::string& port, const std::string& why,
            shm::Nanoseconds now);
  // Somebody has opened it.
  void forget(End end, const std::string& port);
  [[nodiscard]] const std::deque<wire::RefusalStatus>& all() const { return refusals_; }

 private:
  void make_room(std::uint32_t user);

  std::deque<wire::RefusalStatus> refusals_;  // the latest first
};

}  // namespace arbiter::service
