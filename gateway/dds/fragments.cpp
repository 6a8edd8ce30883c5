#include "gateway/dds/fragments.hpp"

#include <dds/dds.h>
#include <dds/ddsi/q_radmin.h>

#include <algorithm>
#include <cstring>

#include "gateway/core/second_copy.hpp"

namespace arbiter::gateway::dds {

namespace {

// Its place in the sample, and there, too. It may have 64 KiB.
void copy_fragment(Bytes from, std::size_t place, WritableBytes to,
                   const SecondCopy* second) noexcept {
  for (std::size_t at = 0; at < from.size(); at += SecondCopy::kBlock) {
    const std::size_t length = std::min(SecondCopy::kBlock, from.size() - at);
    std::byte* const out = to.data() + place + at;
    std::memcpy(out, from.data() + at, length);
    if (second != nullptr) second->add(place + at, {out, length});
  }
}

}  // namespace

// They are in the order of their beginnings, and may overlap.
bool copy_fragments(const nn_rdata* first, std::size_t from, WritableBytes to,
                    const SecondCopy* second) noexcept {
  const std::size_t end = from + to.size();
  std::size_t at = from;
  for (const nn_rdata* fragment = first; fragment != nullptr && at < end;
       fragment = fragment->nextfrag) {
    if (fragment->maxp1 <= at) continue;
    if (fragment->min > at) return false;
    const auto* const bytes =
        NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment)) + (at - fragment->min);
    const std::size_t length = (fragment->maxp1 < end ? fragment->maxp1 : end) - at;
    copy_fragment({reinterpret_cast<const std::byte*>(bytes), length}, at - from, to, second);
    at += length;
  }
  return at == end;
}

}  // namespace arbiter::gateway::dds
