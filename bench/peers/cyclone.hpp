// Cyclone DDS, over UDP on the loopback interface, or between network namespaces.
#pragma once

#include <dds/dds.h>

#include <cstdint>
#include <memory>
#include <string>

namespace arbiter::bench {

// Out of the way of applications, which begin at 0. Port numbers allow up to 232.
inline constexpr dds_domainid_t kDdsDomain = 217;
// Cyclone's settings there.
const char* dds_configuration();
// In a worker, before it makes anything: not on the loopback interface but on that one, with
// Cyclone's own settings.
void set_dds_interface(const char* name);

struct DeleteDdsQos {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using DdsQos = std::unique_ptr<dds_qos_t, DeleteDdsQos>;

// Deletes what is made of it too: topics, readers, writers.
class DdsEntity {
 public:
  DdsEntity() = default;
  // Throws BenchError where it is an error code, which says what could not be made.
  DdsEntity(dds_entity_t entity, const char* what);
  DdsEntity(const DdsEntity&) = delete;
  DdsEntity& operator=(const DdsEntity&) = delete;
  DdsEntity(DdsEntity&& other) noexcept;
  DdsEntity& operator=(DdsEntity&& other) noexcept;
  ~DdsEntity();

  [[nodiscard]] dds_entity_t get() const { return entity_; }

 private:
  dds_entity_t entity_ = 0;
};

// How sources are told apart, as DDS has it: of the writers of one instance, the reader obeys the
// strongest that is alive.
struct DdsOptions {
  std::int32_t strength = 0;
  // A writer that has written nothing for so long counts as gone; 0: never.
  std::int64_t lease_ns = 0;
};

// A worker's own participant. Discovery is on the loopback interface and without multicast, so that
// it works where there is no network.
class DdsParticipant {
 public:
  DdsParticipant();

  [[nodiscard]] dds_entity_t get() const { return participant_.get(); }

  // Of topics that no other session of the benchmark, nor anybody else, is likely to have.
  [[nodiscard]] DdsEntity topic(std::string name) const;
  [[nodiscard]] DdsEntity writer(const DdsEntity& topic, const DdsOptions& options = {}) const;
  [[nodiscard]] DdsEntity reader(const DdsEntity& topic, const DdsOptions& options = {}) const;

 private:
  DdsEntity domain_;
  DdsEntity participant_;
};

// Waits until so many others are connected with it.
void await_readers(const DdsEntity& writer, std::uint32_t readers);
void await_writers(const DdsEntity& reader, std::uint32_t writers);

}  // namespace arbiter::bench
