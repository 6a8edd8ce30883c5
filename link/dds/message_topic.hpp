// A topic on which links speak to all others: each writes, and each reads what the others write.
// Messages are bytes, which the caller judges.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include <arbiter/bytes.hpp>

#include "gateway/core/bridge.hpp"
#include "gateway/dds/reader_cache.hpp"
#include "link/core/card_bytes.hpp"
#include "link/dds/network.hpp"

namespace arbiter::link {

// What becomes of a message.
enum class Delivery {
  kState,    // the last one of each link gets through, and reaches links that come later
  kMessage,  // those that are there get it, unless a dozen newer ones come before it is through
  kPulse,    // it comes or it is lost
};

class MessageTopic : private gateway::dds::SampleTaker {
 public:
  // `writer`: its handle is that by which links that are there are known.
  using Heard = std::function<void(Bytes message, const gateway::dds::SampleWriter& writer)>;

  // `heard` is called on Cyclone's threads, one at a time, and must not wait. Messages of more than
  // `most` bytes are passed over. `bell` rings when writers() change, and outlives this. Throws
  // DdsError.
  MessageTopic(const Network& network, const char* name, Delivery delivery, std::size_t most,
               Heard heard, const gateway::Bell& bell);
  MessageTopic(const MessageTopic&) = delete;
  MessageTopic& operator=(const MessageTopic&) = delete;
  ~MessageTopic() override;

  // Any thread; waits for 0.2 s at most, and only a message does. False: memory is short, or what
  // was sent before is not through yet.
  bool send(const ByteString& message) noexcept;
  // The writers of others that are there now: all of them, however many.
  [[nodiscard]] std::vector<std::uint64_t> writers() const;

 private:
  void take(const gateway::dds::Payload& payload,
            const gateway::dds::SampleWriter& writer) noexcept override;

  const std::size_t most_;
  const Heard heard_;
  gateway::dds::ReaderCache cache_;
  const ddsi_sertype* type_ = nullptr;
  Entity topic_;
  Entity writer_;
  Entity reader_;
  std::vector<std::byte> message_;  // of take()
};

}  // namespace arbiter::link
