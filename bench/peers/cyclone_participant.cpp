#include <algorithm>
#include <utility>

#include "bench/peers/cyclone.hpp"
#include "bench/peers/spin.hpp"
#include "dds_sample.h"

namespace arbiter::bench {
namespace {

// The settings are Cyclone's own but for where it listens. CYCLONEDDS_URI is not looked at:
// whatever stands there is meant for others.
constexpr const char* kConfiguration = R"(
<General>
  <Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>
  <AllowMulticast>false</AllowMulticast>
  <MaxMessageSize>65500B</MaxMessageSize>
</General>
<Discovery>
  <ParticipantIndex>auto</ParticipantIndex>
  <MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>
  <Peers><Peer address="127.0.0.1"/></Peers>
</Discovery>
<Tracing><Verbosity>none</Verbosity></Tracing>)";

std::string on_interface;  // in place of those; empty: they hold

// Of both ends.
DdsQos qos(const DdsOptions& options) {
  DdsQos result(dds_create_qos());
  dds_qset_reliability(result.get(), DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
  dds_qset_history(result.get(), DDS_HISTORY_KEEP_LAST, 8);
  dds_qset_ownership(result.get(), DDS_OWNERSHIP_EXCLUSIVE);
  if (options.lease_ns != 0) {
    dds_qset_liveliness(result.get(), DDS_LIVELINESS_MANUAL_BY_TOPIC, options.lease_ns);
  }
  return result;
}

}  // namespace

const char* dds_configuration() {
  return on_interface.empty() ? kConfiguration : on_interface.c_str();
}

void set_dds_interface(const char* name) {
  on_interface = std::string("<General><Interfaces><NetworkInterface name=\"") + name +
                 "\"/></Interfaces></General><Tracing><Verbosity>none</Verbosity></Tracing>";
}

DdsEntity::DdsEntity(dds_entity_t entity, const char* what) : entity_(entity) {
  if (entity < 0) throw BenchError(std::string(what) + ": " + dds_strretcode(-entity));
}
DdsEntity::DdsEntity(DdsEntity&& other) noexcept : entity_(std::exchange(other.entity_, 0)) {}
DdsEntity& DdsEntity::operator=(DdsEntity&& other) noexcept {
  std::swap(entity_, other.entity_);
  return *this;
}
DdsEntity::~DdsEntity() {
  if (entity_ > 0) dds_delete(entity_);
}

DdsParticipant::DdsParticipant()
    : domain_(dds_create_domain(kDdsDomain, dds_configuration()), "dds_create_domain"),
      participant_(dds_create_participant(kDdsDomain, nullptr, nullptr), "dds_create_participant") {
}

DdsEntity DdsParticipant::topic(std::string name) const {
  std::replace(name.begin(), name.end(), '-', '_');  // which DDS does not allow
  return {dds_create_topic(participant_.get(), &arbiter_bench_DdsSample_desc, name.c_str(), nullptr,
                           nullptr),
          "dds_create_topic"};
}

DdsEntity DdsParticipant::writer(const DdsEntity& topic, const DdsOptions& options) const {
  const DdsQos wanted = qos(options);
  dds_qset_ownership_strength(wanted.get(), options.strength);
  return {dds_create_writer(participant_.get(), topic.get(), wanted.get(), nullptr),
          "dds_create_writer"};
}

DdsEntity DdsParticipant::reader(const DdsEntity& topic, const DdsOptions& options) const {
  return {dds_create_reader(participant_.get(), topic.get(), qos(options).get(), nullptr),
          "dds_create_reader"};
}

void await_readers(const DdsEntity& writer, std::uint32_t readers) {
  spin_until([&] {
    dds_publication_matched_status_t status{};
    dds_get_publication_matched_status(writer.get(), &status);
    return status.current_count >= readers;
  });
}

void await_writers(const DdsEntity& reader, std::uint32_t writers) {
  spin_until([&] {
    dds_subscription_matched_status_t status{};
    dds_get_subscription_matched_status(reader.get(), &status);
    return status.current_count >= writers;
  });
}

}  // namespace arbiter::bench
