// QoS as Cyclone has it: of our ends, from the mapping; and of others' ends, as they announce it.
#pragma once

#include <dds/dds.h>

#include <cstdint>
#include <string>
#include <vector>

#include "gateway/dds/entity.hpp"
#include "gateway/mapping/mapping.hpp"
#include "shm/activity.hpp"

namespace arbiter::gateway::dds {

// How long a reliable writer may wait for a reader that does not keep up, before the sample is
// refused. The gateway's loop waits with it.
inline constexpr shm::Nanoseconds kMaxBlocking = 10'000'000;

enum class End { kReader, kWriter };

// Of one of our ends, without user data.
[[nodiscard]] CycloneQos cyclone_qos(const Qos& qos, End end);
// Of our ends, too: the representation that a writer offers.
[[nodiscard]] Representation offered_representation(const Qos& qos);

// What an end announces, and what two ends are matched by. The numbers of kinds are those of DDS:
// the larger, the stronger.
struct AnnouncedQos {
  int reliability = 0;  // best_effort, reliable
  int durability = 0;   // volatile, transient_local, transient, persistent
  int ownership = 0;    // shared, exclusive
  int liveliness = 0;   // automatic, manual_by_participant, manual_by_topic
  int destination_order = 0;
  shm::Nanoseconds deadline = shm::kForever;
  shm::Nanoseconds latency_budget = 0;
  shm::Nanoseconds lease = shm::kForever;
  std::vector<std::string> partitions;
  bool has_more_partitions = false;  // than are looked at: any may be among them
  std::vector<int> representations;  // 0 XCDR1, 2 XCDR2; of a writer the first counts
};
[[nodiscard]] AnnouncedQos read_announced(const dds_qos_t& qos);
// What one of our ends announces.
[[nodiscard]] AnnouncedQos announced_by(const Qos& qos, End end);

// Bytes that a user of DDS has added; ROS 2 writes "key=value;" there.
[[nodiscard]] std::string user_data(const dds_qos_t& qos);

}  // namespace arbiter::gateway::dds
