// Opening nodes and ports: in any order, under any name that is free, with options within bounds.
#include <gtest/gtest.h>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/hear_all.hpp"

namespace arbiter::test {
namespace {

using namespace std::chrono_literals;

bool delivers(OutputPort<Number>& out, InputPort<Number>& in) {
  static std::int64_t value = 0;
  const Outcome outcome = out.publish(Number{++value});
  auto sample = in.take();
  return outcome.delivered == 1 && sample && (**sample).value == value;
}

TEST(Opening, TheOutputPortMayComeFirst) {
  Daemon daemon(single_model());
  Node sender("sender");
  Node receiver("receiver");
  auto out = sender.output_port<Number>("/out");
  auto in = receiver.input_port<Number>("/in");
  hear_all(sender);
  EXPECT_TRUE(delivers(out, in));
}

TEST(Opening, TheInputPortMayComeFirst) {
  Daemon daemon(single_model());
  Node sender("sender");
  Node receiver("receiver");
  auto in = receiver.input_port<Number>("/in");
  auto out = sender.output_port<Number>("/out");
  hear_all(receiver);
  EXPECT_TRUE(delivers(out, in));
}

TEST(Opening, PortsMayComeBeforeTheModelThatConnectsThem) {
  Daemon daemon;
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  EXPECT_FALSE(delivers(out, in));
  daemon.load(single_model());
  hear_all(node);
  EXPECT_TRUE(delivers(out, in));
}

TEST(Opening, APortMayBeClosedAndOpenedAgainManyTimes) {
  Daemon daemon(single_model());
  Node sender("sender");
  Node receiver("receiver");
  auto in = receiver.input_port<Number>("/in");
  for (int i = 0; i < 100; ++i) {
    auto out = sender.output_port<Number>("/out");
    hear_all(receiver);
    ASSERT_TRUE(delivers(out, in)) << i;
  }
  auto out = sender.output_port<Number>("/out");
  for (int i = 0; i < 100; ++i) {
    in = {receiver.input_port<Number>("/elsewhere")};
    in = {receiver.input_port<Number>("/in")};
    hear_all(sender);
    ASSERT_TRUE(delivers(out, in)) << i;
  }
}

// The name is free as soon as the port is closed, whoever asks for it next.
TEST(Opening, ANameIsFreeAtOnceForAnotherNode) {
  Daemon daemon(single_model());
  Node nodes[2] = {Node("first"), Node("second")};
  for (int i = 0; i < 200; ++i) {
    auto out = nodes[i % 2].output_port<Number>("/out");
    auto in = nodes[i % 2].input_port<Number>("/in");
    ASSERT_TRUE(delivers(out, in));
  }
}

TEST(Opening, ANameIsFreeAtOnceWhenItsNodeGoes) {
  Daemon daemon(single_model());
  for (int i = 0; i < 100; ++i) {
    Node node("test");
    auto out = node.output_port<Number>("/out");
  }
}

TEST(Opening, ANameIsFreeAtOnceWhenItsProcessHasEnded) {
  Daemon daemon(single_model());
  for (int i = 0; i < 20; ++i) {
    Component component("component");
    ASSERT_EQ(component.tell("output /out"), "open");
    ASSERT_EQ(component.tell("input /in 8 1 0"), "open");
    EXPECT_EQ(component.tell("publish /out 1"), "1 0 0");
    component.kill();
  }
}

TEST(Opening, ANameThatALiveComponentHasIsRefused) {
  Daemon daemon(single_model());
  Node first("first");
  Node second("second");
  auto out = first.output_port<Number>("/out");
  auto in = first.input_port<Number>("/in");
  for (Node* node : {&first, &second}) {
    const auto output = error_of([&] { static_cast<void>(node->output_port<Number>("/out")); });
    EXPECT_NE(output.find("/out is held by node \"first\" (pid"), std::string::npos) << output;
    const auto input = error_of([&] { static_cast<void>(node->input_port<Number>("/in")); });
    EXPECT_NE(input.find("/in is held by node \"first\" (pid"), std::string::npos) << input;
  }
  EXPECT_TRUE(delivers(out, in)) << "those who have the names are not disturbed";
}

TEST(Opening, AnInputAndAnOutputPortMayBearTheSameName) {
  Daemon daemon(rules(arbiter_at("/x", select("/x"))));
  Node node("test");
  auto out = node.output_port<Number>("/x");
  auto in = node.input_port<Number>("/x");
  EXPECT_TRUE(delivers(out, in));
}

TEST(Opening, AMalformedNameIsRefused) {
  Daemon daemon;
  Node node("test");
  const std::vector<std::string> bad{"",
                                     "x",
                                     "/a b",
                                     "/a\tb",
                                     "/a\nb",
                                     "/a\x7f",
                                     std::string("/a\0b", 4),
                                     "/" + std::string(255, 'a')};
  for (const auto& name : bad) {
    EXPECT_THROW(static_cast<void>(node.output_port<Number>(name)), Error) << name;
    EXPECT_THROW(static_cast<void>(node.input_port<Number>(name)), Error) << name;
  }
  EXPECT_THROW(Node(""), Error);
  EXPECT_THROW(Node("two words"), Error);
  EXPECT_THROW(Node(std::string(256, 'n')), Error);
}

TEST(Opening, ChoicesAreAmongThoseThatThereAre) {
  Daemon daemon(single_model());
  Node node("test");
  EXPECT_EQ(error_of([&] { auto in = node.input_port<int>("/in", {.when_full = WhenFull(7)}); }),
            "/in: when_full is 7, but must be from 0 to 1");
  EXPECT_EQ(error_of([&] { auto tap = node.tap<int>("/out", {.of = TapOf(9)}); }),
            "/out: of is 9, but must be from 0 to 1");
}

TEST(Opening, ANameOfTheGreatestLengthIsFine) {
  const std::string longest = "/" + std::string(254, 'a');
  Daemon daemon(rules(arbiter_at(longest, select(longest))));
  Node node(std::string(255, 'n'));
  auto out = node.output_port<Number>(longest);
  auto in = node.input_port<Number>(longest);
  EXPECT_TRUE(delivers(out, in));
  EXPECT_EQ(in.winner(), longest);
}

TEST(Opening, ANameOfBytesThatAreNoTextIsRefused) {
  Daemon daemon;
  EXPECT_EQ(error_of([] { Node node("n\xff"); }),
            R"("n\xff" is not a name for a node: it has a byte that is not UTF-8 in it)");
  Node node("test");
  EXPECT_EQ(error_of([&] { static_cast<void>(node.output_port<Number>("/o\xc3\x28")); }),
            R"("/o\xc3(" is not a name for a port: it has a byte that is not UTF-8 in it)");
}

TEST(Opening, OptionsOutOfBoundsAreRefusedByName) {
  Daemon daemon;
  Node node("test");
  const auto refusal = [&](const InputPortOptions& options) {
    return error_of([&] { static_cast<void>(node.input_port<Number>("/in", options)); });
  };
  EXPECT_NE(refusal({.depth = 0}).find("depth"), std::string::npos);
  EXPECT_NE(refusal({.depth = 1025}).find("depth"), std::string::npos);
  EXPECT_NE(refusal({.max_held = 0}).find("max_held"), std::string::npos);
  EXPECT_NE(refusal({.max_held = 65}).find("max_held"), std::string::npos);
  EXPECT_EQ(refusal({.depth = 1024, .max_held = 64}), "no error");
  const auto output = [&](const OutputPortOptions& options) {
    return error_of([&] { static_cast<void>(node.output_port("/out", options)); });
  };
  EXPECT_NE(output({.max_loans = 0}).find("max_loans"), std::string::npos);
  EXPECT_NE(output({.max_loans = 65}).find("max_loans"), std::string::npos);
  EXPECT_NE(output({.max_size = std::size_t{1} << 50}).find("max_size"), std::string::npos);
  EXPECT_EQ(output({.max_size = std::size_t{1} << 39}),
            "/out: its samples need a max_memory of 2748779069440, which is above the bound "
            "17163091968");
  EXPECT_NE(output({.max_memory = 0}).find("max_memory"), std::string::npos);
  EXPECT_EQ(output({.max_size = 0, .max_loans = 64}), "no error");
}

TEST(Opening, TheGreatestDepthsAndHoldsWork) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out", {.max_loans = 64});
  auto in = node.input_port<Number>("/in", {.depth = 1024, .max_held = 64});
  for (int i = 0; i < 2000; ++i) ASSERT_EQ(out.publish(Number{i}).delivered, 1u);
  std::vector<Sample<Number>> held;
  for (int i = 0; i < 64; ++i) held.push_back(std::move(*in.take()));
  EXPECT_THROW(static_cast<void>(in.take()), Error);
  std::vector<Loan<Number>> loans;
  for (int i = 0; i < 64; ++i) loans.push_back(std::move(*out.loan()));
  for (int i = 0; i < 2000; ++i) ASSERT_EQ(out.publish(Number{i}).delivered, 1u);
  for (int i = 0; i < 64; ++i) EXPECT_EQ(held[static_cast<std::size_t>(i)]->value, 976 + i);
  for (auto& loan : loans) EXPECT_EQ(out.publish(std::move(loan)).delivered, 1u);
}

TEST(Opening, ANodeThrowsASentenceWhereNoDaemonAnswers) {
  const ScopedVariable runtime("XDG_RUNTIME_DIR", "/nonexistent");
  const auto what = error_of([] {
    NodeOptions options;
    options.instance = "nobody-runs-this";
    options.connect_timeout = 1ms;
    Node("test", options);
  });
  EXPECT_NE(what.find("no arbiterd of instance \"nobody-runs-this\" answered within 1 ms"),
            std::string::npos)
      << what;
}

TEST(Opening, ANodeWaitsForItsDaemon) {
  Daemon daemon;
  daemon.terminate();
  std::thread late([&] { Node("test", {.connect_timeout = std::chrono::milliseconds::max()}); });
  daemon.restart();
  late.join();
}

TEST(Opening, ATimeoutBelowZeroIsRefused) {
  const Daemon daemon;
  EXPECT_EQ(error_of([] { Node("test", {.connect_timeout = -1ms}); }),
            "connect_timeout is -1 ms, but must not be below 0");
}

TEST(Opening, TheInstanceMayBeGivenOrComeFromTheEnvironment) {
  Daemon daemon(kNoRules, {.instance = "robot-1"});
  Node by_environment("a");
  Node by_name("b", {.instance = "robot-1"});
  EXPECT_THROW(Node("c", {.instance = "robot-2", .connect_timeout = 1ms}), Error);
  EXPECT_THROW(Node("c", {.instance = "../robot-1", .connect_timeout = 1ms}), Error);
  const ScopedVariable other("ARBITER_INSTANCE", "robot-2");
  EXPECT_THROW(Node("c", {.connect_timeout = 1ms}), Error);
  Node by_name_again("d", {.instance = "robot-1"});
}

TEST(Opening, WithoutAnyNameTheInstanceIsDefault) {
  Daemon daemon(kNoRules, {.instance = "default"});
  const ScopedVariable unset("ARBITER_INSTANCE", std::nullopt);
  Node node("test");
}

TEST(Opening, ManyPortsInOneNodeAndSeveralNodesInOneProcess) {
  constexpr int kPorts = 60;
  Daemon daemon(fan_out_model(kPorts));
  Node a("a");
  Node b("b");
  std::vector<InputPort<Number>> inputs;
  for (int i = 0; i < kPorts; ++i) {
    inputs.push_back((i % 2 == 0 ? a : b).input_port<Number>("/in" + std::to_string(i)));
  }
  auto out = a.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{7}).delivered, static_cast<std::uint32_t>(kPorts));
  for (auto& in : inputs) EXPECT_EQ(take_from(in), 7);
}

TEST(Opening, PortsMayBeOpenedByManyThreadsAtOnce) {
  Daemon daemon(fan_out_model(32));
  Node node("test");
  auto out = node.output_port<Number>("/out");
  std::vector<std::thread> threads;
  std::atomic<int> received{0};
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 8; ++i) {
        auto in = node.input_port<Number>("/in" + std::to_string(8 * t + i));
        auto sample = in.wait_for(std::chrono::hours::max());
        received += sample ? 1 : 0;
      }
    });
  }
  while (received < 32) out.publish(Number{1});
  for (auto& thread : threads) thread.join();
}

TEST(Opening, WithoutAServiceThreadTheNodeSeesChangesWhenItIsServiced) {
  Daemon daemon(single_model());
  Node node("test", {.service_thread = false});
  Node other("other");
  auto out = node.output_port<Number>("/out");
  {
    auto in = other.input_port<Number>("/in");
    EXPECT_EQ(out.publish(Number{1}).delivered, 0u) << "nobody has told it";
    pollfd readable{node.service_fd(), POLLIN, 0};
    EXPECT_EQ(::poll(&readable, 1, -1), 1);
    node.service();
    EXPECT_EQ(out.publish(Number{2}).delivered, 1u);
    EXPECT_EQ(take_from(in), 2);
  }
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(out.publish(Number{3}).delivered, 1u);
  EXPECT_EQ(take_from(in), 3);
}

TEST(Opening, ServicingANodeThatHasAThreadForItDoesNoHarm) {
  Daemon daemon(fan_out_model(8));
  Node node("test");
  std::thread servicing([&] {
    for (int i = 0; i < 2000; ++i) node.service();
  });
  for (int i = 0; i < 8; ++i) {
    auto in = node.input_port<Number>("/in" + std::to_string(i));
    auto out = node.output_port<Number>("/out");
    EXPECT_TRUE(delivers(out, in));
  }
  servicing.join();
}

}  // namespace
}  // namespace arbiter::test
