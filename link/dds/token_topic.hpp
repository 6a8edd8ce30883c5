// The topic by which importing links send their tokens to those that export.
//
// Best effort: a repeated token is worth nothing, because the next one is newer.
#pragma once

#include <functional>

#include "gateway/dds/reader_cache.hpp"
#include "link/core/cards.hpp"
#include "link/dds/network.hpp"

namespace arbiter::link {

class TokenTopic : private gateway::dds::SampleTaker {
 public:
  // `writer`: the key of who has sent it.
  using Heard = std::function<void(const TokenMessage& message, std::uint64_t writer)>;
  // `heard` is called on Cyclone's threads, one at a time. Throws DdsError.
  TokenTopic(const Network& network, Heard heard);
  TokenTopic(const TokenTopic&) = delete;
  TokenTopic& operator=(const TokenTopic&) = delete;
  ~TokenTopic() override;

  // Any thread.
  void send(const TokenMessage& message) noexcept;

 private:
  void take(const gateway::dds::Payload& payload,
            const gateway::dds::SampleWriter& writer) noexcept override;

  const Heard heard_;
  gateway::dds::ReaderCache cache_;
  const ddsi_sertype* type_ = nullptr;
  Entity topic_;
  Entity writer_;
  Entity reader_;
};

}  // namespace arbiter::link
