// Messages that wait in the daemon.
#pragma once

#include <sys/types.h>

#include <memory>

#include "service/policy/shares.hpp"
#include "wire/messages.hpp"

namespace arbiter::service {

// A message that cannot be handled yet, and what keeping it costs its user. What it has brought and
// nobody takes is closed as an errand of his.
class PutAside {
 public:
  PutAside() = default;
  // Throws LimitExceeded, and then `received` is as it was.
  PutAside(wire::Received& received, uid_t user, Shares& shares);
  PutAside(PutAside&& other) noexcept = default;
  PutAside& operator=(PutAside&& other) noexcept;
  PutAside(const PutAside&) = delete;
  PutAside& operator=(const PutAside&) = delete;
  ~PutAside();

  [[nodiscard]] wire::Received& received() const { return *received_; }
  // What it costs is given back: whoever puts the message aside again is charged again.
  void give_back() {
    bytes_ = {};
    descriptors_ = {};
  }

 private:
  std::unique_ptr<wire::Received> received_;
  uid_t user_ = 0;
  Charge bytes_;
  Charge descriptors_;
};

}  // namespace arbiter::service
