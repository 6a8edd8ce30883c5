// What a reader of ours has in place of Cyclone's cache of samples: nothing. Each sample goes to
// its taker while Cyclone delivers it, on the thread that has received it.
//
// So nothing waits in the reader, nothing is stored or locked for a queue, and the bytes are copied
// once, from Cyclone's receive buffer to where the taker puts them. History and depth of the reader
// mean nothing here; its writers do not see that.
//
// Cyclone's interface for this (dds/ddsc/dds_rhc.h) is public, but not promised to stay. Its
// behaviour on which this relies, in 0.10: store() is called for each sample and reader before the
// receive buffer may be used again, and a cache that does not keep a sample need not.
//
// Thread safety: the taker is called by one thread at a time, which may be another each time.
#pragma once

#include <dds/dds.h>
#include <dds/ddsc/dds_rhc.h>

#include <array>
#include <cstdint>
#include <mutex>

#include "gateway/dds/payload.hpp"

namespace arbiter::gateway::dds {

// Who has written a sample.
struct SampleWriter {
  dds_instance_handle_t handle = 0;  // by which dds_get_matched_publications() names it
  // Of its participant: with what GUIDs of all that this has begin, as on the wire. Nobody else's
  // writer has it, as far as the network can be believed.
  std::array<std::uint8_t, 12> participant{};
};

class SampleTaker {
 public:
  SampleTaker() = default;
  SampleTaker(const SampleTaker&) = delete;
  SampleTaker& operator=(const SampleTaker&) = delete;
  virtual ~SampleTaker() = default;

  // The payload is valid until it returns. Must not wait. As in a listener of Cyclone's, which is
  // called with the same locks, samples may be written, and nothing may be opened or closed.
  virtual void take(const Payload& payload, const SampleWriter& writer) noexcept = 0;
};

// Outlives the reader that has it.
class ReaderCache {
 public:
  // Keeps a reference.
  explicit ReaderCache(SampleTaker& taker);
  ReaderCache(const ReaderCache&) = delete;
  ReaderCache& operator=(const ReaderCache&) = delete;
  ~ReaderCache() = default;

  // For dds_create_reader_rhc().
  [[nodiscard]] dds_rhc* cache() noexcept { return &hook_.cyclone; }

 private:
  struct Hook {
    dds_rhc cyclone;  // first: Cyclone knows it by this
    ReaderCache* self;
  };
  // What Cyclone calls.
  struct Calls;

  void store(const ddsi_serdata& data, ddsi_tkmap_instance* instance,
             const SampleWriter& writer) noexcept;
  void let_go() noexcept;

  Hook hook_;
  SampleTaker& taker_;
  std::mutex mutex_;  // of all below, and of the taker
  ddsi_tkmap* instances_ = nullptr;
  // The one that all samples belong to. It is held, or Cyclone would make it again for each sample.
  ddsi_tkmap_instance* instance_ = nullptr;
};

}  // namespace arbiter::gateway::dds
