// publish_at(): arrivals whose time is given. The tests' times are in the past, so nothing waits.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/run_program.hpp"

namespace arbiter::test {
namespace {

using namespace std::chrono_literals;

Time now() { return std::chrono::steady_clock::now(); }
std::int64_t count(Time time) { return time.time_since_epoch().count(); }

TEST(Replay, ASampleBearsTheTimeThatIsGiven) {
  Daemon daemon(single_model("3600s"));
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in", {.max_held = 2});
  const Time at = now() - 1s;
  EXPECT_EQ(out.publish_at(at, Number{1}).delivered, 1u);
  EXPECT_EQ(out.publish_at(at + 1ns, std::move(*out.loan())).delivered, 1u);
  const auto first = in.take();
  const auto second = in.take();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->stamp_ns(), count(at));
  EXPECT_EQ(second->stamp_ns(), count(at) + 1);
  EXPECT_TRUE(daemon.source("/out")["active"]);
}

TEST(Replay, HoldsForBytesToo) {
  Daemon daemon(single_model("3600s"));
  Node node("test");
  auto out = node.output_port("/out");
  auto in = node.input_port("/in");
  const Time at = now() - 1s;
  const std::byte byte{7};
  EXPECT_EQ(out.publish_at(at, Bytes(&byte, 1)).delivered, 1u);
  EXPECT_EQ(out.publish_at(at, std::move(*out.loan(3))).delivered, 1u);
  EXPECT_EQ(in.take()->size(), 1u);
  EXPECT_EQ(in.take()->size(), 3u);
}

// Its activity has ended by now. At its time it was the winner; who looks now sees nobody.
TEST(Replay, AnArrivalMayHaveExpiredWhenItComes) {
  Daemon daemon(override_model("1s"));
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  const Time at = now() - 10s;
  EXPECT_EQ(high.publish_at(at, Number{1}).delivered, 1u);
  EXPECT_FALSE(daemon.source("/high")["active"]);
  EXPECT_TRUE(in.idle());
  EXPECT_EQ(in.winner(), std::nullopt);
  EXPECT_EQ(low.publish_at(at + 999'999'999ns, Number{2}).discarded, 1u) << "overridden then";
  EXPECT_EQ(low.publish_at(at + 1s, Number{3}).delivered, 1u) << "and not a nanosecond later";
  EXPECT_EQ(take_from(in), 1) << "its own expiry does not drop it";
  EXPECT_EQ(take_from(in), 3);
  EXPECT_EQ(take_from(in), kNothing);
  EXPECT_EQ(low.publish(Number{4}).delivered, 1u);
}

TEST(Replay, WhoCommandsNowIsNotOverriddenByWhatIsOver) {
  Daemon daemon(override_model("3600s"));
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  high.publish(Number{1});
  // At its time /high was not active yet; but it is now, and this call is made now.
  EXPECT_EQ(low.publish_at(now() - 1s, Number{2}).discarded, 1u);
  EXPECT_EQ(take_from(in), 1);
}

TEST(Replay, SignalsAndDeactivationsHaveTimesToo) {
  Daemon daemon(override_model("3600s"));
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  const Time at = now() - 1s;
  EXPECT_EQ(high.signal_at(at).delivered, 0u);
  EXPECT_EQ(in.winner(), "/high");
  high.deactivate_at(at + 10ns);
  EXPECT_TRUE(in.idle());
  EXPECT_EQ(low.publish_at(at, Number{1}).delivered, 1u);
  EXPECT_EQ(high.publish_at(at + 11ns, Number{2}).delivered, 1u);
}

TEST(Replay, TheFutureIsRefused) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out", {.max_loans = 1});
  auto in = node.input_port<Number>("/in");
  const std::string why = error_of([&] { out.publish_at(now() + 1h, Number{1}); });
  EXPECT_NE(why.find("/out: an arrival at "), std::string::npos) << why;
  EXPECT_NE(why.find("later than now"), std::string::npos) << why;
  EXPECT_THROW(out.publish_at(now() + 1h, std::move(*out.loan())), Error);
  EXPECT_TRUE(out.loan()) << "it is free again";
  EXPECT_THROW(out.signal_at(now() + 1h), Error);
  EXPECT_THROW(out.deactivate_at(now() + 1h), Error);
  EXPECT_FALSE(in.take());
  const auto source = daemon.source("/out");
  EXPECT_FALSE(source["active"]);
  EXPECT_EQ(source["published"], 0);
  EXPECT_EQ(source["signals"], 0);
}

TEST(Replay, TheClockDoesNotGoBelowZero) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  const std::string why = "/out: an arrival at -1 ns is refused: CLOCK_MONOTONIC begins at 0";
  EXPECT_EQ(error_of([&] { out.publish_at(Time(-1ns), Number{1}); }), why) << "nothing came before";
  out.publish(Number{1});
  EXPECT_EQ(error_of([&] { out.publish_at(Time(-1ns), Number{1}); }), why);
  EXPECT_EQ(error_of([&] { out.signal_at(Time::min()); }),
            "/out: an arrival at -9223372036854775808 ns is refused: CLOCK_MONOTONIC begins at 0");
}

TEST(Replay, TimeDoesNotGoBack) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  const Time at = now() - 1s;
  out.publish_at(at, Number{1});
  EXPECT_NE(error_of([&] { out.publish_at(at - 1ns, Number{2}); }).find("that is 1 ns before"),
            std::string::npos);
  EXPECT_NO_THROW(out.publish_at(at, Number{3})) << "two arrivals may come at one time";
  out.deactivate_at(at + 1ns);
  EXPECT_THROW(out.publish_at(at, Number{4}), Error);
  EXPECT_THROW(out.publish_at(at + 1ns, Number{5}), Error) << "the deactivation would be undone";
  EXPECT_NO_THROW(out.publish_at(at + 2ns, Number{6}));
  out.publish(Number{7});  // at its own time
  EXPECT_THROW(out.publish_at(at + 3ns, Number{8}), Error);
}

TEST(Replay, APredecessorsLastArrivalCounts) {
  for (const char* timeout : {"1s", "forever"}) {
    Daemon daemon(single_model(timeout));
    Node node("test");
    const Time at = now() - 10s;
    { node.output_port<Number>("/out").signal_at(at); }
    auto out = node.output_port<Number>("/out");
    EXPECT_THROW(out.signal_at(at - 1ns), Error);
    EXPECT_NO_THROW(out.signal_at(at));
  }
}

TEST(Replay, IsAllowedByThePolicyOnly) {
  const TemporaryDirectory files;
  const std::string policy =
      files.write("policy", "deny everyone replay /out*\nallow everyone all\n");
  Daemon daemon(single_model(), {.arguments = {"--policy", policy}});
  Node node("test");
  auto out = node.output_port<Number>("/out");
  const std::string why = error_of([&] { out.publish_at(now(), Number{1}); });
  EXPECT_EQ(why.rfind("/out: user ", 0), 0u) << why;
  EXPECT_NE(why.find("may not replay the source /out"), std::string::npos) << why;
  EXPECT_NE(why.find("policy:1 says: deny everyone replay /out*"), std::string::npos) << why;
  EXPECT_FALSE(daemon.source("/out")["active"]);
  EXPECT_EQ(out.publish(Number{1}).delivered, 0u) << "all else is as it was";
  auto other = node.output_port<Number>("/other");
  EXPECT_NO_THROW(other.publish_at(now(), Number{1}));
}

// Whatever the time of each call, in the order of the trace the decisions are those of simulate,
// which replays it with an injected clock.
TEST(Replay, IsDecidedAsSimulateSays) {
  constexpr int kEvents = 400;
  const std::string model = rules(
      arbiter_at("/in", select("/low", "not /high and not /stop") + select("/high", "not /stop")) +
          arbiter_at("/aux", select("/low", "/high or /stop") + select("/stop", "not /low")),
      "20ms");
  Daemon daemon(model);
  const TemporaryDirectory files;
  Node node("test");
  std::map<std::string, OutputPort<Number>> sources;
  for (const char* name : {"/low", "/high", "/stop"}) {
    sources.emplace(name, node.output_port<Number>(name));
  }
  auto in = node.input_port<Number>("/in", {.depth = 1024, .keep = true});
  auto aux = node.input_port<Number>("/aux", {.depth = 1024, .keep = true});

  const unsigned seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const Time start = now() - 10s;
  std::string trace = "t_ns,source,event\n";
  std::map<std::int64_t, std::uint32_t> delivered;  // live, by time
  std::int64_t t = 0;
  for (int i = 0; i < kEvents; ++i) {
    t += 1 + random() % 15'000'000;
    auto& [name, port] = *std::next(sources.begin(), random() % 3);
    const Time at = start + std::chrono::nanoseconds(t);
    const bool ends = random() % 8 == 0;
    trace += std::to_string(t) + "," + name + (ends ? ",deactivate\n" : ",arrive\n");
    if (ends) {
      port.deactivate_at(at);
    } else {
      delivered[t] = port.publish_at(at, Number{i}).delivered;
    }
  }

  const auto simulated =
      run_program({std::string(ARBITER_PROGRAMS) + "/arbiter", "simulate",
                   files.write("model.xml", model), "--trace", files.write("trace.csv", trace)});
  ASSERT_EQ(simulated.exit_code, 0) << simulated.err;
  std::map<std::int64_t, std::uint32_t> expected;
  for (const auto& [time, count] : delivered) expected[time] = 0;
  std::istringstream rows(simulated.out);
  for (std::string row; std::getline(rows, row);) {
    if (row.find(",delivered,") != std::string::npos) ++expected[std::stoll(row)];
  }
  EXPECT_EQ(delivered, expected);
  const auto accepted = take_all(in).size() + take_all(aux).size();
  EXPECT_EQ(accepted, static_cast<std::size_t>(
                          std::count_if(delivered.begin(), delivered.end(),
                                        [](const auto& each) { return each.second != 0; })));
}

}  // namespace
}  // namespace arbiter::test
