// Where the samples of an `in` entry go straight on: what an `out` entry has to know of it.
#pragma once

#include "gateway/core/announced.hpp"
#include "gateway/mapping/mapping.hpp"

namespace arbiter::gateway {

class Outgoing;

class Feed {
 public:
  explicit Feed(const Entry& entry) : entry_(entry) {}  // keeps a reference

  [[nodiscard]] const Entry& entry() const noexcept { return entry_; }

  // What Incoming::deliver() publishes is what that `out` entry sends: deliver() then sends it
  // there itself, until nothing comes there any more. Outlives the last deliver(). The gateway's
  // loop.
  void follow(Outgoing& outgoing) noexcept {
    if (!entry_.choice) outgoing_.announce(outgoing);
  }

  // Of deliver(): the entry that it sends to, or null; and nothing comes there any more.
  [[nodiscard]] Outgoing* outgoing() const noexcept { return outgoing_.get(); }
  void withdraw() noexcept { outgoing_.withdraw(); }

 private:
  const Entry& entry_;
  Announced<Outgoing> outgoing_;
};

}  // namespace arbiter::gateway
