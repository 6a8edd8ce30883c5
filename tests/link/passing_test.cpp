// Rules 2, 4, 5 and 6 of docs/hosts.md: what passes between hosts, and what does not; --max-age;
// deactivations that nobody has heard; a third host that keeps the speaker that it has.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>

#include "tests/link/robot.hpp"
#include "tests/support/run_program.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::Not;

class Hosts : public LoopbackHosts {};

TEST_F(Hosts, ASampleThatIsPublishedOnOneArrivesAtAPortOfTheOther) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  Body body(base);
  EXPECT_GT(body.drive(planner), 0);
  EXPECT_EQ(body.motor().winner(), kPlanner);
  base.await_described(kPlanner, "host head");
  EXPECT_EQ(body.hold().publish(Speed{0}).discarded, 1U) << "decided where it is received";
}

// What the motor gets is numbered by the link; where it began, it says as well.
TEST_F(Hosts, ASampleSaysWhichOneItWasThere) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  const auto next = [&] {
    for (;;) {
      planner.publish();
      if (auto sample = body.motor().take()) return std::pair((*sample)->number, sample->origin());
    }
  };
  const auto [number, origin] = next();
  const auto [later_number, later_origin] = next();
  EXPECT_NE(origin.publisher, 0U);
  EXPECT_EQ(later_origin.publisher, origin.publisher);
  EXPECT_EQ(later_origin.sequence - origin.sequence,
            static_cast<std::uint64_t>(later_number - number));
}

TEST_F(Hosts, ASampleOf16MiBCrosses) {
  constexpr std::size_t kLargest = std::size_t{16} << 20;
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Node brain = head.node("brain");
  auto planner = brain.output_port(kPlanner, Type::variable("robot/Cloud", kLargest));
  Node body = base.node("body");
  auto motor = body.input_port(kMotor);
  const std::vector<std::byte> cloud(kLargest, std::byte{7});
  await([&] {
    planner.publish(Bytes(cloud.data(), cloud.size()));
    const auto got = motor.wait_for(500ms);
    return got && got->size() == kLargest && (**got)[kLargest - 1] == std::byte{7};
  });
}

TEST_F(Hosts, ADeactivationEndsTheActivityOnTheOtherHost) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  planner.port().deactivate();
  body.fall_back();
}

// Whoever joins is told what the source is like: it need not have seen how it came to that.
TEST_F(Hosts, ADeactivationIsSaidToWhoeverComesBack) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  base.link().kill();
  planner.port().deactivate();
  base.start_link();
  body.fall_back();
}

// Of a source of `head`, to a host that was there before, and has come again.
void deactivation_is_said_later(Host& head, Host& base) {
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  base.link().signal(SIGTERM);
  ASSERT_EQ(base.link().wait(), 0);
  await([&] { return head.daemon().source(kPlanner)["taps"].empty(); });
  planner.port().deactivate();
  base.start_link();
  body.fall_back();
}

TEST_F(Hosts, ADeactivationIsSaidToWhoeverComesWhenNobodyHasListenedSince) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  deactivation_is_said_later(head, base);
}

// What it says of a silent source does not depend on a model.
TEST_F(Hosts, ADeactivationIsSaidByAHostWithoutAModel) {
  Host head("head", runtime_, "", network());
  Host base("base", runtime_, motor_model("1000s"), network());
  deactivation_is_said_later(head, base);
}

TEST_F(Hosts, OnlyWhatAnotherHostsModelWantsIsTapped) {
  Host head("head", runtime_, kNoRules, network());
  Planner planner(head);
  Node eye = head.node("eye");
  auto camera = eye.output_port<Speed>("/Camera/image:o");
  head.see("host head, on the loopback interface");
  Host base("base", runtime_, motor_model("1000s"), network());
  Body body(base);
  body.drive(planner);
  EXPECT_FALSE(head.daemon().source(kPlanner)["taps"].empty());
  EXPECT_TRUE(head.daemon().source("/Camera/image:o")["taps"].empty());
  EXPECT_EQ(base.described("/Camera/image:o"), "");
  base.daemon().load(kNoRules);
  await([&] { return head.daemon().source(kPlanner)["taps"].empty(); });
}

TEST_F(Hosts, WhatIsImportedIsNotExported) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Host rear("rear", runtime_, motor_model("1000s"), network());
  Planner planner(head);
  Body front(base);
  Body back(rear);
  front.drive(planner);
  back.drive(planner);
  // Had one of them offered it to the other, both would have said so.
  await([&] { return head.daemon().source(kPlanner)["taps"].size() == 1; });
  front.drive(planner);
  back.drive(planner);
  EXPECT_THAT(base.log(), Not(HasSubstr("several hosts")));
  EXPECT_THAT(rear.log(), Not(HasSubstr("several hosts")));
}

TEST_F(Hosts, EachObeysItsOwnComponent) {
  Host base("base", runtime_, motor_model("1000s"), network());
  auto near = std::make_unique<Planner>(base);
  Host head("head", runtime_, kNoRules, network());
  Planner far(head);
  Body body(base);
  body.drive(*near);
  base.see("host base, on");
  head.see("host head, on");
  EXPECT_TRUE(head.daemon().source(kPlanner)["open"]);
  body.drive(*near);
  EXPECT_EQ(base.described(kPlanner), "") << "no link has it open";
  near.reset();
  await([&] {
    far.publish();
    return base.described(kPlanner).find("host head") != std::string::npos;
  });
}

// A planner on a host whose link has the name. On a busy machine the link may take longer to yield
// than the daemon waits for it.
std::unique_ptr<Planner> planner_where_it_is_imported(const Host& host, std::int64_t published) {
  for (;;) {
    try {
      return std::make_unique<Planner>(host, published);
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("is held by node \"arbiter-link\""));
    }
  }
}

TEST_F(Hosts, AComponentHasItsNameThoughItIsImportedAndTheImportComesBackAfterIt) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner far(head);
  Body body(base);
  for (std::int64_t round = 1; round <= 2; ++round) {
    await([&] {
      far.publish();
      return base.described(kPlanner).find("host head") != std::string::npos;
    });
    auto near = planner_where_it_is_imported(base, round * 1'000'000);
    while (body.motor().take()) {
    }
    body.drive(*near);
    EXPECT_EQ(base.described(kPlanner), "") << "no link has it open";
    EXPECT_EQ(base.daemon().source(kPlanner)["component"]["node"], "brain");
    EXPECT_EQ(body.hold().publish(Speed{0}).discarded, 1U) << "the source stays active";
  }
  base.see("is opened by a component of this host, and is not imported any more");
  EXPECT_THAT(base.log(), Not(HasSubstr("is not imported: ")));
}

// The other one says what the source there is like, when it is imported again.
TEST_F(Hosts, AnOldDeactivationDoesNotEndWhatAComponentHereHasBegun) {
  constexpr std::int64_t kNear = 1'000'000;
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Planner far(head);
  Body body(base);
  body.drive(far);
  far.port().deactivate();
  body.fall_back();
  Node watcher = base.node("watcher");
  Tap<void> tap = watcher.tap(kPlanner);
  body.drive(*planner_where_it_is_imported(base, kNear));
  await([&] { return base.described(kPlanner).find("host head") != std::string::npos; });
  await([&] {  // what is sent before has come by then
    far.publish();
    const auto sample = body.motor().take();
    return sample && (*sample)->number < kNear;
  });
  bool was_heard = false;
  while (const auto event = tap.take()) {
    EXPECT_NE(event->kind(), TapEventKind::deactivation);
    was_heard = was_heard || event->kind() == TapEventKind::sample;
  }
  EXPECT_TRUE(was_heard);
}

// Its offer is whole before it has sent anything.
TEST_F(Hosts, AnUntypedSourceThatIsSilentIsImported) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Node brain = head.node("brain");
  OutputPortOptions options;
  options.max_size = 77;
  auto planner = brain.output_port(kPlanner, options);
  base.await_described(kPlanner, "host head");
  const nlohmann::json imported = base.daemon().source(kPlanner);
  EXPECT_TRUE(imported["type"].is_null());
  EXPECT_EQ(imported["max_size"], 77);
  Node body = base.node("body");
  auto motor = body.input_port(kMotor);
  await([&] {
    planner.publish(Bytes(reinterpret_cast<const std::byte*>("go"), 2));
    const auto got = motor.wait_for(5ms);
    return got && got->size() == 2;
  });
}

// No sample gets here so fast, so none is an arrival.
TEST_F(Hosts, TheOptionSaysHowOldASampleMayBe) {
  Host head("head", runtime_, kNoRules, network());
  for (const char* const timeout : {"forever", "1000s"}) {
    std::vector<std::string> options = network();
    options.insert(options.end(), {"--max-age", "1ns"});
    Host base("base", runtime_, motor_model(timeout), options);
    Planner planner(head);
    Body body(base);
    await([&] {
      planner.publish();
      return base.described(kPlanner).find(" late") != std::string::npos;
    });
    EXPECT_FALSE(body.motor().take());
    EXPECT_FALSE(base.daemon().source(kPlanner)["active"]);
  }
}

TEST_F(Hosts, AMaximumAgeThatIsNoneIsWrongUse) {
  for (const char* const age : {"0ms", "forever", "5", "1.5s", "-1s", ""}) {
    const auto result = run_program(
        {std::string(ARBITER_PROGRAMS) + "/arbiter-link", "--max-age=" + std::string(age)});
    EXPECT_EQ(result.exit_code, 2) << age;
    EXPECT_THAT(result.err, HasSubstr("--max-age")) << age;
  }
}

TEST(LinkOptions, AreRefusedWhereTheyAreWrong) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong{
      {{"--peer", "192.0.2.1"}, "--peer: leads nowhere without an --interface"},
      {{"--interface", "lo", "--peer", "no address"},
       "--peer: \"no address\" is neither an IPv4 address nor the name of a host"},
      {{"--interface", "lo", "--peer", "fd00::2"},
       "--peer: \"fd00::2\" is neither an IPv4 address"},
      {{"--interface", "lo", "--peer", "fe80::1%lo"}, "\"fe80::1%lo\" is neither an IPv4 address"},
      {{"--interface", "lo", "--peer", "127.0.0.1:65536"}, "is neither an IPv4 address"},
      {{"--interface", "lo", "--peer", "127.0.0.1:x"}, "is neither an IPv4 address"},
      {{"--interface", "fe80::1%lo"}, "--interface: \"fe80::1%lo\" is an address of IPv6"},
      {{"--interface", ""}, "--interface: is empty: name a network interface"},
      {{"--interface", "lo", "--interface", "lo"}, "--interface: names \"lo\" twice"},
      {{"--instance", "a/b"}, "\"a/b\" is not a name for an instance"},
      {{"--intrface", "lo"}, "has no option \"--intrface\"; did you mean \"--interface\"?"}};
  for (const auto& [options, message] : wrong) {
    std::vector<std::string> typed{std::string(ARBITER_PROGRAMS) + "/arbiter-link"};
    typed.insert(typed.end(), options.begin(), options.end());
    const auto result = run_program(typed);
    EXPECT_EQ(result.exit_code, 2) << options.front();
    EXPECT_THAT(result.err, HasSubstr(message));
  }
}

TEST_F(Hosts, EachLinkSaysWhatItOffersAndWants) {
  Host head("head", runtime_, kNoRules, network());
  head.see("offers what components of this host will open: nothing yet; imports nothing: ");
  const Planner planner(head);
  head.link().kill();
  head.start_link();
  head.see("offers what components of this host have open: /Planner/speed:o; imports nothing: ");
  Host base("base", runtime_, motor_model("1000s"), network());
  base.see("imports from other hosts, unless it is open here: /Hold/speed:o, /Planner/speed:o");
}

// False: on a busy machine base has lost head meanwhile, and has had to take the other.
bool keeps_its_speaker(const TemporaryDirectory& runtime, const std::vector<std::string>& network) {
  Host head("head", runtime, kNoRules, network);
  Host base("base", runtime, motor_model("1000s"), network);
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  const Host rear("rear", runtime, kNoRules, network);
  const Planner other(rear);
  const auto is_described = [&](const char* text) {
    return base.described(kPlanner).find(text) != std::string::npos;
  };
  const auto is_said = [&](const char* text) { return base.log().find(text) != std::string::npos; };
  bool has_head = true;
  const auto await_with_head = [&](const std::function<bool()>& holds) {
    await([&] {
      has_head = has_head && !is_said("taken from rear") && !is_described("host rear");
      return !has_head || holds();
    });
  };
  await_with_head(
      [&] { return is_said("open on several hosts: head, rear; it is taken from head"); });
  await_with_head([&] { return is_described("head, rear"); });
  await_with_head([&] { return body.commanded_by(planner).has_value(); });
  await_with_head([&] { return is_described("host head"); });
  if (!has_head) return false;
  head.link().kill();  // its lease ends
  base.await_described(kPlanner, "host rear");
  return true;
}

TEST_F(Hosts, AThirdOneKeepsTheSpeakerThatItHasAndNamesBoth) {
  while (!keeps_its_speaker(runtime_, network())) {
  }
}

// Its numbers begin again there, and nothing of it must be taken for what came before.
TEST_F(Hosts, APublisherThatIsStartedAgainIsHeardFromItsFirstSampleOn) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("forever"), network());
  Body body(base);
  std::int64_t published = 0;
  {
    Planner planner(head);
    while (planner.published() < 200) body.drive(planner);
    published = planner.published();
  }
  base.see("is not imported any more");
  Planner again(head, published);
  body.drive(again);
  base.await_described(kPlanner, "host head");
  EXPECT_THAT(base.described(kPlanner), Not(HasSubstr("twice")));
  again.port().deactivate();
  body.fall_back();
}

TEST_F(Hosts, AnotherTypeOpensThePortAgain) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1000s"), network());
  Node body = base.node("body");
  auto motor = body.input_port(kMotor);
  Node brain = head.node("brain");
  for (const char* const type : {"robot/Speed", "robot/Torque"}) {
    auto port = brain.output_port(kPlanner, Type::variable(type, 100));
    const std::array<std::byte, 3> sample{std::byte{1}, std::byte{2}, std::byte{3}};
    await([&] {
      port.publish(Bytes(sample.data(), sample.size()));
      const auto got = motor.wait_for(5ms);
      return got && got->type().name() == type && got->size() == sample.size();
    });
  }
}

}  // namespace
}  // namespace arbiter::test
