// Why two ends of one topic do not match. DDS counts such ends, where it says anything at all; what
// people need is the policy, both values, and what to write.
#pragma once

#include <string>
#include <vector>

#include "gateway/dds/peers.hpp"
#include "gateway/mapping/mapping.hpp"

namespace arbiter::gateway::dds {

// One of our ends.
struct OurEnd {
  End end = End::kReader;
  const DdsTopic& topic;
  bool keyed = false;
};

// Why it does not match a peer of the other kind on the same topic: "reliability: the writer offers
// best_effort, this entry asks for reliable; write reliability="best_effort" to take it". Empty: it
// does. What both sides' types look like inside is not compared: their names are.
[[nodiscard]] std::vector<std::string> mismatches(const OurEnd& ours, const Peer& peer);

// Whether they have a partition in common, or may have one, because there are too many to compare.
[[nodiscard]] bool may_meet(const Qos& ours, const AnnouncedQos& theirs);

}  // namespace arbiter::gateway::dds
