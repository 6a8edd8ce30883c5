// Rule 9 of docs/hosts.md: what strangers on the network send is judged, counted, and moves
// nothing. Rule 4: nor does what names no token of this link. Rule 7: nor, after T, who sends
// headers alone. Rule 6: two machines of one name are named.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>

#include "link/core/cards.hpp"
#include "link/core/event_header.hpp"
#include "link/core/held_tokens.hpp"
#include "link/dds/network.hpp"
#include "link/dds/token_topic.hpp"
#include "shm/clock.hpp"
#include "tests/gateway/dds/noise.hpp"
#include "tests/link/robot.hpp"
#include "tests/link/stranger.hpp"

namespace arbiter::test {
namespace {

using link::EventHeader;
using link::EventKind;

using NoisyHosts = LoopbackHosts;

TEST_F(NoisyHosts, LiveThroughDatagramsThatAreNoneOfRtps) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  send_noise(domain_);
  body.drive(planner);
  for (Host* const each : {&head, &base}) {
    each->link().signal(SIGTERM);
    EXPECT_EQ(each->link().wait(), 0) << each->log();
    EXPECT_LT(each->log().size(), 100'000U);
  }
}

class HostileHost : public LoopbackHosts {
 protected:
  explicit HostileHost(const std::string& timeout = "1000s") : timeout_(timeout) {}

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

  const std::string timeout_;
  Host base_{"base", runtime_, motor_model(timeout_), network()};
  Body body_{base_};
  const link::Network network_{{domain_.number(), {}, {}}};
  const Pulses pulses_{network_};
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

// One event with the last of all numbers would make all that follow come twice.
TEST_F(HostileHost, NobodySpeaksInTheNameOfAnother) {
  send_until(" late", [&] { stranger_.send([](EventHeader&) {}); });
  Stranger forger(network_, 665, "forger");
  await([&] { return forger.is_wanted(); });
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

// Which writers are looked at first is by chance, in each life of the head's link.
TEST_F(HostileHost, ManyWritersOfOneHideNoHost) {
  std::deque<Stranger> many;
  for (link::Incarnation each = 1000; each < 1100; ++each)
    many.emplace_back(network_, each, "many");
  for (int life = 0; life < 5; ++life) {
    Host head("head", runtime_, kNoRules, network());
    const Planner planner(head);
    base_.await_described(kPlanner, "open on several hosts: head, ");
    head.link().kill();
    await([&] { return base_.described(kPlanner).find("head") == std::string::npos; });
  }
}

// The second one is taken for the next life of the first, until both are there for too long.
TEST_F(HostileHost, TwoMachinesWithOneNameAreNamed) {
  const Host namesake("head", runtime_, kNoRules, network(), {}, {}, "stranger");
  const Planner planner(namesake);
  base_.see("several machines that are all called stranger");
  base_.await_described(kPlanner, "several machines are called stranger");
}

// A stranger who hears the tokens of the links, and names them.
class HostileExporter : public HostileHost {
 protected:
  explicit HostileExporter(const std::string& timeout = "300ms") : HostileHost(timeout) {}

  // Without another number where `again`.
  void send_in_time(EventKind kind, bool again = false) {
    stranger_.send(
        [&](EventHeader& header) {
          header.kind = kind;
          if (again) header.number = header.sequence = number_;
          number_ = header.number;
          held_.name(shm::monotonic_now(), header.tokens);
        },
        kind == EventKind::kWithheld ? 0 : sizeof(Speed));
  }
  void take_the_motor(EventKind kind) {
    await([&] {
      send_in_time(kind);
      return body_.motor().winner() == kPlanner;
    });
  }

  std::uint64_t number_ = 0;
  link::HeldTokens held_;
  link::TokenTopic tokens_{
      network_, [this](const link::TokenMessage& message, std::uint64_t writer) {
        held_.note(message.importer, message.number, writer, shm::monotonic_now());
      }};
};

// Its tokens, which it names because it has heard of us, are from the future: nothing moves.
TEST_F(HostileExporter, NumbersThatLeapCountAsLost) {
  send_until(" lost", [&] {
    stranger_.send([&](EventHeader& header) {
      header.number *= 1'000'000'000'000;
      held_.name(shm::monotonic_now(), header.tokens);
      for (auto& token : header.tokens) token.number += 1'000'000;
    });
  });
}

// It would hold the place of the winner, and nobody would command the motor.
TEST_F(HostileExporter, OneThatKeepsItsSamplesThoughTheyAreWantedIsTakenForSilent) {
  take_the_motor(EventKind::kSample);  // headers alone are believed for 300 ms only
  await([&] {
    send_in_time(EventKind::kWithheld);
    body_.hold().publish(Speed{0});
    const auto got = body_.motor().wait_for(2ms);
    return got && got->source() == kHold;
  });
  await([&] {
    send_in_time(EventKind::kWithheld);
    return base_.described(kPlanner).find("withheld though they were wanted") != std::string::npos;
  });
}

class PatientHostileExporter : public HostileExporter {
 protected:
  PatientHostileExporter() : HostileExporter("1000s") {}
};

TEST_F(PatientHostileExporter, ASampleThatItSendsAgainAndAgainComesOnce) {
  take_the_motor(EventKind::kWithheld);
  for (int i = 0; i < 5; ++i) send_in_time(EventKind::kAgain, true);
  int taken = 0;
  await([&] {
    while (body_.motor().take()) ++taken;
    return base_.described(kPlanner).find("twice") != std::string::npos;
  });
  while (body_.motor().take()) ++taken;
  EXPECT_EQ(taken, 1);
}

// It may be heard before the link knows that the first writer has gone.
TEST_F(PatientHostileExporter, ADeactivationByAnotherWriterOfTheSameLifeHolds) {
  take_the_motor(EventKind::kWithheld);
  Stranger same_life(network_);
  same_life.send(
      [&](EventHeader& header) {
        header.kind = EventKind::kDeactivation;
        header.is_deactivated = true;
        header.number = header.sequence = number_ + 1;
        held_.name(shm::monotonic_now(), header.tokens);
      },
      0);
  stranger_.leave();
  await([&] { return body_.motor().winner() == std::nullopt; });
}

}  // namespace
}  // namespace arbiter::test
