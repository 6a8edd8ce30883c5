#include "gateway/dds/cyclone_qos.hpp"

#include <algorithm>
#include <array>

namespace arbiter::gateway::dds {
namespace {

// So many names of partitions of one end are looked at: it is a stranger that says them.
constexpr std::uint32_t kMaxPartitions = 64;
constexpr std::size_t kMaxPartitionName = 256;
constexpr std::uint32_t kMaxRepresentations = 8;  // likewise; there are three

dds_history_kind_t cyclone_history(History history) {
  return history == History::kKeepAll ? DDS_HISTORY_KEEP_ALL : DDS_HISTORY_KEEP_LAST;
}

shm::Nanoseconds bounded(dds_duration_t duration) {
  return duration < 0 || duration >= shm::kForever ? shm::kForever : duration;
}

void read_partitions(const dds_qos_t& qos, AnnouncedQos& result) {
  std::uint32_t count = 0;
  char** names = nullptr;
  if (!dds_qget_partition(&qos, &count, &names)) return;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (i < kMaxPartitions) {
      result.partitions.push_back(std::string(names[i]).substr(0, kMaxPartitionName));
    }
    dds_free(names[i]);
  }
  result.has_more_partitions = count > kMaxPartitions;
  dds_free(names);
}

void read_representations(const dds_qos_t& qos, AnnouncedQos& result) {
  std::uint32_t count = 0;
  dds_data_representation_id_t* kinds = nullptr;
  if (dds_qget_data_representation(&qos, &count, &kinds)) {
    result.representations.assign(kinds, kinds + std::min(count, kMaxRepresentations));
    dds_free(kinds);
  }
  // What an end says that says nothing (DDS-XTypes 7.6.3.1.1).
  if (result.representations.empty()) result.representations = {DDS_DATA_REPRESENTATION_XCDR1};
}

}  // namespace

Representation offered_representation(const Qos& qos) {
  return qos.representation.value_or(Representation::kXcdr1);
}

CycloneQos cyclone_qos(const Qos& qos, End end) {
  CycloneQos result(dds_create_qos());
  dds_qos_t* const to = result.get();
  dds_qset_reliability(to,
                       qos.reliability == Reliability::kReliable ? DDS_RELIABILITY_RELIABLE
                                                                 : DDS_RELIABILITY_BEST_EFFORT,
                       0);  // OutTopic waits, where it may
  dds_qset_durability(to, qos.durability == Durability::kTransientLocal
                              ? DDS_DURABILITY_TRANSIENT_LOCAL
                              : DDS_DURABILITY_VOLATILE);
  const auto depth = static_cast<std::int32_t>(std::clamp<std::uint32_t>(qos.depth, 1, 1U << 20));
  dds_qset_history(to, cyclone_history(qos.history), depth);
  if (end == End::kWriter) {
    // What a late reader of a transient-local writer is given. Never all that was ever sent: that
    // has no bound, and most of it no longer holds.
    dds_qset_durability_service(to, 0, DDS_HISTORY_KEEP_LAST, depth, DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  }
  if (qos.deadline) dds_qset_deadline(to, *qos.deadline);
  std::vector<const char*> partitions;
  for (const std::string& partition : qos.partitions) partitions.push_back(partition.c_str());
  if (!partitions.empty()) {
    dds_qset_partition(to, static_cast<std::uint32_t>(partitions.size()), partitions.data());
  }
  const AnnouncedQos announced = announced_by(qos, end);
  std::vector<dds_data_representation_id_t> representations;
  for (const int kind : announced.representations) {
    representations.push_back(static_cast<dds_data_representation_id_t>(kind));
  }
  dds_qset_data_representation(to, static_cast<std::uint32_t>(representations.size()),
                               representations.data());
  return result;
}

AnnouncedQos announced_by(const Qos& qos, End end) {
  AnnouncedQos result;
  result.reliability = qos.reliability == Reliability::kReliable ? 1 : 0;
  result.durability = qos.durability == Durability::kTransientLocal ? 1 : 0;
  result.deadline = qos.deadline.value_or(shm::kForever);
  result.partitions = qos.partitions;
  const int representation = offered_representation(qos) == Representation::kXcdr2
                                 ? DDS_DATA_REPRESENTATION_XCDR2
                                 : DDS_DATA_REPRESENTATION_XCDR1;
  if (end == End::kWriter || qos.representation) {
    result.representations = {representation};
  } else {  // a sample says in its header how it is written
    result.representations = {DDS_DATA_REPRESENTATION_XCDR1, DDS_DATA_REPRESENTATION_XCDR2};
  }
  return result;
}

AnnouncedQos read_announced(const dds_qos_t& qos) {
  AnnouncedQos result;
  dds_reliability_kind_t reliability{};
  dds_durability_kind_t durability{};
  dds_ownership_kind_t ownership{};
  dds_liveliness_kind_t liveliness{};
  dds_destination_order_kind_t order{};
  dds_duration_t duration = 0;
  if (dds_qget_reliability(&qos, &reliability, &duration)) result.reliability = reliability;
  if (dds_qget_durability(&qos, &durability)) result.durability = durability;
  if (dds_qget_ownership(&qos, &ownership)) result.ownership = ownership;
  if (dds_qget_destination_order(&qos, &order)) result.destination_order = order;
  if (dds_qget_liveliness(&qos, &liveliness, &duration)) {
    result.liveliness = liveliness;
    result.lease = bounded(duration);
  }
  if (dds_qget_deadline(&qos, &duration)) result.deadline = bounded(duration);
  if (dds_qget_latency_budget(&qos, &duration)) result.latency_budget = bounded(duration);
  read_partitions(qos, result);
  read_representations(qos, result);
  return result;
}

std::string user_data(const dds_qos_t& qos) {
  void* bytes = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(&qos, &bytes, &size) || bytes == nullptr) return {};
  std::string result(static_cast<const char*>(bytes), size);
  dds_free(bytes);
  return result;
}

}  // namespace arbiter::gateway::dds
