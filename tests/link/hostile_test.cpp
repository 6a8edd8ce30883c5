// What strangers on the network send: it is judged, counted, and moves nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "link/core/cards.hpp"
#include "link/core/event_header.hpp"
#include "link/dds/event_topic.hpp"
#include "link/dds/network.hpp"
#include "tests/link/robot.hpp"

namespace arbiter::test {
namespace {

using link::EventHeader;
using link::EventKind;

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
  void send(const std::function<void(EventHeader&)>& spoil, std::size_t size = sizeof(Speed)) {
    EventHeader header;
    header.kind = EventKind::kSample;
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

 private:
  const gateway::Bell bell_;
  link::OfferCard card_;
  std::uint64_t number_ = 0;
  std::optional<link::EventWriter> writer_;
};

class HostileHost : public testing::Test {
 protected:
  // Sends until the status says that of the source; the motor gets nothing of it.
  void send_until(const std::string& text, const std::function<void()>& send) {
    await([&] {
      send();
      EXPECT_FALSE(body_.motor().take());
      return base_.described(kPlanner).find(text) != std::string::npos;
    });
    EXPECT_EQ(body_.motor().winner(), std::nullopt);
    EXPECT_FALSE(base_.daemon().source(kPlanner)["active"]);
  }

  const OwnDomain domain_;
  const TemporaryDirectory runtime_;
  Host base_{
      "base", runtime_, motor_model("1000s"), {"--domain", std::to_string(domain_.number())}};
  Body body_{base_};
  const link::Network network_{{domain_.number(), {}, {}}};
  Stranger stranger_{network_};
};

TEST_F(HostileHost, ASampleThatNamesNoTokenMovesNothing) {
  send_until(" late", [&] { stranger_.send([](EventHeader&) {}); });
}

TEST_F(HostileHost, TokensThatNobodySentMoveNothing) {
  send_until(" late", [&] {
    stranger_.send([](EventHeader& header) {
      for (std::uint64_t i = 1; i <= link::kMaxImporters; ++i) header.tokens.push_back({i, i});
    });
  });
}

TEST_F(HostileHost, WhatIsNoEventIsCounted) {
  send_until(" unreadable", [&] {
    stranger_.write(link::ByteString(100, std::byte{0xff}));
    stranger_.write({});
    stranger_.send([](EventHeader& header) { header.length = link::kMaxSampleBytes; });
  });
}

TEST_F(HostileHost, NumbersThatLeapCountAsLost) {
  send_until(" lost", [&] {
    stranger_.send([](EventHeader& header) { header.number *= 1'000'000'000'000; });
  });
}

// One event with the last of all numbers would make all that follow come twice.
TEST_F(HostileHost, NobodySpeaksInTheNameOfAnother) {
  send_until(" late", [&] { stranger_.send([](EventHeader&) {}); });
  Stranger forger(network_, 667, "forger");
  base_.await_described(kPlanner, "open on several hosts");
  forger.send([](EventHeader& header) {
    header.exporter = 666;
    header.number = ~std::uint64_t{0};
  });
  const std::string before = base_.described(kPlanner);
  await([&] {
    stranger_.send([](EventHeader&) {});
    const std::string now = base_.described(kPlanner);
    EXPECT_THAT(now, testing::Not(testing::HasSubstr("twice")));
    return now != before || HasFailure();
  });
}

// The second one is taken for the next life of the first, until both are there for too long.
TEST_F(HostileHost, TwoMachinesWithOneNameAreNamed) {
  const Stranger namesake(network_, 667);
  base_.see("several machines that are all called stranger");
  base_.await_described(kPlanner, "several machines are called stranger");
}

}  // namespace
}  // namespace arbiter::test
