// A subscriber of iceoryx whose chunks are known by their headers. Iceoryx's own knows a chunk by
// its payload, and reads where the one is from the other: both stand in memory that whoever has
// sent it may write, and a chunk that is not found again is never given back.
#pragma once

#include <iceoryx_posh/popo/untyped_subscriber.hpp>

namespace arbiter::gateway {

class Subscriber : public iox::popo::UntypedSubscriber {
 public:
  using UntypedSubscriber::UntypedSubscriber;

  using UntypedSubscriber::takeChunk;
  void release_chunk(const iox::mepoo::ChunkHeader& chunk) noexcept { port().releaseChunk(&chunk); }
};

}  // namespace arbiter::gateway
