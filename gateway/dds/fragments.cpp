#include "gateway/dds/fragments.hpp"

#include <dds/dds.h>
#include <dds/ddsi/q_radmin.h>

#include <algorithm>
#include <cstring>

#include "gateway/core/incoming.hpp"

namespace arbiter::gateway::dds {

namespace {

// A fragment may have 64 KiB.
void copy_block(const unsigned char* from, std::byte* to, std::byte* also,
                std::size_t size) noexcept {
  for (std::size_t at = 0; at < size; at += kCopyBlock) {
    const std::size_t length = std::min(kCopyBlock, size - at);
    std::memcpy(to + at, from + at, length);
    std::memcpy(also + at, to + at, length);
  }
}

}  // namespace

// They are in the order of their beginnings, and may overlap.
bool copy_fragments(const nn_rdata* first, std::size_t from, WritableBytes to,
                    WritableBytes also) noexcept {
  const std::size_t end = from + to.size();
  std::size_t at = from;
  for (const nn_rdata* fragment = first; fragment != nullptr && at < end;
       fragment = fragment->nextfrag) {
    if (fragment->maxp1 <= at) continue;
    if (fragment->min > at) return false;
    const auto* const bytes =
        NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment)) + (at - fragment->min);
    const std::size_t length = (fragment->maxp1 < end ? fragment->maxp1 : end) - at;
    std::byte* const out = to.data() + (at - from);
    if (also.empty()) {
      std::memcpy(out, bytes, length);
    } else {
      copy_block(bytes, out, also.data() + (at - from), length);
    }
    at += length;
  }
  return at == end;
}

}  // namespace arbiter::gateway::dds
