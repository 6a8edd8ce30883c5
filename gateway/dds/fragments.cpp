#include "gateway/dds/fragments.hpp"

#include <dds/dds.h>
#include <dds/ddsi/q_radmin.h>

#include <cstring>

namespace arbiter::gateway::dds {

// They are in the order of their beginnings, and may overlap.
bool copy_fragments(const nn_rdata* first, std::size_t from, WritableBytes to) noexcept {
  const std::size_t end = from + to.size();
  std::size_t at = from;
  for (const nn_rdata* fragment = first; fragment != nullptr && at < end;
       fragment = fragment->nextfrag) {
    if (fragment->maxp1 <= at) continue;
    if (fragment->min > at) return false;
    const auto* const bytes =
        NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment)) + (at - fragment->min);
    const std::size_t length = (fragment->maxp1 < end ? fragment->maxp1 : end) - at;
    std::memcpy(to.data() + (at - from), bytes, length);
    at += length;
  }
  return at == end;
}

}  // namespace arbiter::gateway::dds
