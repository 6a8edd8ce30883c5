#include "gateway/dds/arrived_sample.hpp"

#include <cstring>

#include "gateway/dds/fragments.hpp"

namespace arbiter::gateway::dds {

ArrivedSample::ArrivedSample(const Payload& payload) noexcept : payload_(payload) {
  if (payload.size >= kEncapsulationBytes &&
      ArrivedSample::copy(0, WritableBytes(header_.data(), header_.size()))) {
    encapsulation_ = read_encapsulation(Bytes(header_.data(), header_.size()));
  }
}

bool ArrivedSample::copy(std::size_t from, WritableBytes to) const noexcept {
  if (payload_.fragments != nullptr) return copy_fragments(payload_.fragments, from, to);
  std::memcpy(to.data(), payload_.bytes() + from, to.size());
  return true;
}

}  // namespace arbiter::gateway::dds
