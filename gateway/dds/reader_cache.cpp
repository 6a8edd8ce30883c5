#include "gateway/dds/reader_cache.hpp"

#include <arpa/inet.h>
#include <dds/ddsi/ddsi_tkmap.h>

#include <cstring>

namespace arbiter::gateway::dds {
namespace {

// Cyclone has GUIDs in this machine's order, and in that of the wire where it tells them.
SampleWriter writer_of(const ddsi_writer_info& info) noexcept {
  SampleWriter writer;
  writer.handle = info.iid;
  std::uint8_t* to = writer.participant.data();
  for (const std::uint32_t each : info.guid.prefix.u) {
    const std::uint32_t word = htonl(each);
    std::memcpy(to, &word, sizeof word);
    to += sizeof word;
  }
  return writer;
}

}  // namespace

struct ReaderCache::Calls {
  static ReaderCache& of(void* cache) noexcept { return *static_cast<Hook*>(cache)->self; }

  static dds_return_t associate(dds_rhc* cache, dds_reader* /*reader*/,
                                const ddsi_sertype* /*type*/, ddsi_tkmap* instances) {
    of(cache).instances_ = instances;
    return DDS_RETCODE_OK;
  }
  // True: it has been taken; false would have Cyclone try it again.
  static bool store(ddsi_rhc* cache, const ddsi_writer_info* writer, ddsi_serdata* data,
                    ddsi_tkmap_instance* instance) {
    of(cache).store(*data, instance, writer_of(*writer));
    return true;
  }
  static void unregister_writer(ddsi_rhc* /*cache*/, const ddsi_writer_info* /*writer*/) {}
  static void relinquish_ownership(ddsi_rhc* /*cache*/, const std::uint64_t /*writer*/) {}
  static void set_qos(ddsi_rhc* /*cache*/, const dds_qos* /*qos*/) {}
  static void free(ddsi_rhc* cache) { of(cache).let_go(); }

  // Nobody reads.
  static std::int32_t read(dds_rhc* /*cache*/, bool /*lock*/, void** /*values*/,
                           dds_sample_info_t* /*infos*/, std::uint32_t /*most*/,
                           std::uint32_t /*mask*/, dds_instance_handle_t /*handle*/,
                           dds_readcond* /*condition*/) {
    return 0;
  }
  static std::int32_t read_data(dds_rhc* /*cache*/, bool /*lock*/, ddsi_serdata** /*values*/,
                                dds_sample_info_t* /*infos*/, std::uint32_t /*most*/,
                                std::uint32_t /*sample_states*/, std::uint32_t /*view_states*/,
                                std::uint32_t /*instance_states*/,
                                dds_instance_handle_t /*handle*/) {
    return 0;
  }
  static bool add_condition(dds_rhc* /*cache*/, dds_readcond* /*condition*/) { return false; }
  static void remove_condition(dds_rhc* /*cache*/, dds_readcond* /*condition*/) {}
  static std::uint32_t lock_samples(dds_rhc* /*cache*/) { return 0; }

  static const dds_rhc_ops operations;
};

const dds_rhc_ops ReaderCache::Calls::operations = {
    {store, unregister_writer, relinquish_ownership, set_qos, free},
    read,
    read,
    read_data,
    read_data,
    add_condition,
    remove_condition,
    lock_samples,
    associate,
};

ReaderCache::ReaderCache(SampleTaker& taker) : hook_{}, taker_(taker) {
  hook_.cyclone.common.ops = &Calls::operations;
  hook_.self = this;
}

// Cyclone's locks: that of the readers of one writer is held here, as in a listener. Nothing that
// takes the same one is called from here on; a writer of ours that writes takes its own.
void ReaderCache::store(const ddsi_serdata& data, ddsi_tkmap_instance* instance,
                        const SampleWriter& writer) noexcept {
  const std::lock_guard lock(mutex_);
  if (instance_ == nullptr) {
    ddsi_tkmap_instance_ref(instance);
    instance_ = instance;
  }
  // That an instance has been disposed of, or has lost its writer, is no sample; one may come with
  // it.
  if (data.kind == SDK_DATA) taker_.take(*payload_of(&data), writer);
}

void ReaderCache::let_go() noexcept {
  const std::lock_guard lock(mutex_);
  if (instance_ != nullptr) ddsi_tkmap_instance_unref(instances_, instance_);
  instance_ = nullptr;
}

}  // namespace arbiter::gateway::dds
