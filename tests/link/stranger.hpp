// A program on the network that is no link.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "gateway/core/bridge.hpp"
#include "link/core/cards.hpp"
#include "link/core/event_header.hpp"
#include "link/core/pulse.hpp"
#include "link/dds/event_topic.hpp"
#include "link/dds/message_topic.hpp"
#include "link/dds/network.hpp"
#include "link/desk_topics.hpp"
#include "link/token_clock.hpp"
#include "shm/clock.hpp"
#include "tests/link/robot.hpp"

namespace arbiter::test {

// Says that it is there, and hears others, as links do: who does not is not believed for long.
class Pulses {
 public:
  explicit Pulses(const link::Network& network, link::Incarnation life = 666)
      : round_trips_(life),
        topic_(
            network, link::kPulseTopic, link::Delivery::kPulse, link::kMostPulseBytes,
            [this](Bytes bytes, const gateway::dds::SampleWriter& writer) {
              const auto pulse = link::read_pulse(bytes);
              const std::lock_guard lock(mutex_);
              if (pulse) round_trips_.note(*pulse, writer.participant, shm::monotonic_now());
            },
            bell_),
        clock_([this] {
          std::unique_lock lock(mutex_);
          const link::ByteString pulse = link::write_pulse(round_trips_.next(shm::monotonic_now()));
          lock.unlock();
          static_cast<void>(topic_.send(pulse));
        }) {
    clock_.set_period(link::RoundTrips::kPulsePeriod);
  }

 private:
  const gateway::Bell bell_;
  std::mutex mutex_;
  link::RoundTrips round_trips_;
  link::MessageTopic topic_;
  link::TokenClock clock_;
};

// A program on the network that says that it has the planner.
class Stranger {
 public:
  explicit Stranger(const link::Network& network, link::Incarnation incarnation = 666,
                    const std::string& host = "stranger") {
    card_.incarnation = incarnation;
    card_.host = host;
    card_.source = kPlanner;
    card_.type_revision = 1;
    const Type type = type_of<Speed>();
    card_.type.set_name(type.name());
    card_.type.size = type.size();
    card_.type.alignment = type.alignment();
    writer_.emplace(network, card_, bell_);
  }
  // An event that is proper but for what `spoil` makes of it.
  void send(const std::function<void(link::EventHeader&)>& spoil,
            std::size_t size = sizeof(Speed)) {
    link::EventHeader header;
    header.kind = link::EventKind::kSample;
    header.exporter = card_.incarnation;
    header.number = ++number_;
    header.sequence = number_;
    header.type_revision = 1;
    header.length = static_cast<std::uint32_t>(size);
    spoil(header);
    link::ByteString bytes(link::header_bytes(header));
    link::write_header(header, WritableBytes(bytes.data(), bytes.size()));
    const std::vector<std::byte> sample(size);
    write(bytes, Bytes(sample.data(), sample.size()));
  }
  void write(const link::ByteString& header, Bytes sample = {}) {
    static_cast<void>(writer_->write(Bytes(header.data(), header.size()), sample));
  }
  // Somebody reads it.
  [[nodiscard]] bool is_wanted() const { return writer_->is_wanted(); }
  void leave() { writer_.reset(); }

 private:
  const gateway::Bell bell_;
  link::OfferCard card_;
  std::uint64_t number_ = 0;
  std::optional<link::EventWriter> writer_;
};

}  // namespace arbiter::test
