#include "service/clients/put_aside.hpp"

#include <cstddef>
#include <utility>

#include "wire/hang_up.hpp"

namespace arbiter::service {

PutAside::PutAside(wire::Received& received, uid_t user, Shares& shares) : user_(user) {
  bytes_ = shares.take(user, Share::kQueue, sizeof received);
  const std::size_t count = received.descriptor_count;
  if (count != 0) descriptors_ = shares.take(user, Share::kDescriptors, count);
  received_ = std::make_unique<wire::Received>(std::move(received));
}

PutAside& PutAside::operator=(PutAside&& other) noexcept {
  std::swap(received_, other.received_);
  std::swap(user_, other.user_);
  std::swap(bytes_, other.bytes_);
  std::swap(descriptors_, other.descriptors_);
  return *this;
}

PutAside::~PutAside() {
  if (received_ != nullptr) wire::dispose_of(*received_, user_);
}

}  // namespace arbiter::service
