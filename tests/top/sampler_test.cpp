// What is seen of a real instance: a daemon in a process of its own, ports in this one.
#include "top/sampler.hpp"

#include <gtest/gtest.h>

#include <arbiter/arbiter.hpp>

#include "shm/clock.hpp"
#include "tests/top/pictures.hpp"
#include "tests/watch/watched.hpp"

namespace arbiter::top {
namespace {

// Activity ends only by deactivate(), so that no test depends on time.
const std::string kModel = R"(<behaviors timeout="forever">
  <behavior name="Low"><config at="/p:i">/low:o</config></behavior>
  <behavior name="High"><config at="/p:i">/high:o</config><inhibition>Low</inhibition></behavior>
</behaviors>)";

class TopSampler : public testing::Test {
 protected:
  void take_census() { take_census(sampler_); }
  void take_census(Sampler& sampler) {
    StampedStatus now;
    now.status = instance_->status();
    now.at = shm::monotonic_now();
    now.wall = std::chrono::system_clock::now();
    sampler.set_census(std::make_shared<const Census>(census_of(now, nullptr)));
  }
  std::shared_ptr<const Frame> look() {
    sampler_.look();
    return sampler_.frame();
  }
  static std::string winner_of(const Frame& frame, const std::string& port) {
    const auto place = static_cast<std::size_t>(frame.census->find_port(port));
    const std::int32_t winner = frame.ports.at(place).winner;
    if (winner == kNobody) return "nobody";
    if (winner < 0) return std::to_string(winner);
    return frame.census->sources.at(static_cast<std::size_t>(winner)).name;
  }

  test::Daemon daemon_{kModel};
  std::shared_ptr<watch::Instance> instance_ = test::watched(daemon_);
  Sampler sampler_{instance_};
};

// With both sources open, and what a tap tells of them in `told_`.
class TappingSampler : public TopSampler {
 protected:
  TappingSampler() { take_census(tapping_); }

  Node node_{"test"};
  OutputPort<int> low_ = node_.output_port<int>("/low:o");
  OutputPort<int> high_ = node_.output_port<int>("/high:o");
  std::vector<Accepted> told_;
  Sampler tapping_{instance_, [this] { return std::exchange(told_, {}); }};
};

TEST_F(TopSampler, HasNoPictureBeforeItKnowsThePorts) {
  EXPECT_EQ(look(), nullptr);
  take_census();
  ASSERT_NE(look(), nullptr);
  EXPECT_EQ(winner_of(*look(), "/p:i"), "nobody");
  EXPECT_TRUE(sampler_.new_takeovers().empty());
}

TEST_F(TopSampler, TellsEachChangeOfAWinnerAndWhatMadeIt) {
  Node node("test");
  auto low = node.output_port<int>("/low:o");
  auto high = node.output_port<int>("/high:o");
  take_census();
  look();
  const shm::Nanoseconds before = shm::monotonic_now();
  low.publish(1);
  EXPECT_EQ(winner_of(*look(), "/p:i"), "/low:o");
  high.publish(1);
  const auto frame = look();
  EXPECT_EQ(winner_of(*frame, "/p:i"), "/high:o");
  EXPECT_EQ(frame->takeovers, 2u);
  high.deactivate();
  EXPECT_EQ(winner_of(*look(), "/p:i"), "/low:o");
  low.deactivate();
  EXPECT_EQ(winner_of(*look(), "/p:i"), "nobody");

  const auto takeovers = sampler_.new_takeovers();
  ASSERT_EQ(takeovers.size(), 4u);
  EXPECT_EQ(takeovers[0].before, "");
  EXPECT_EQ(takeovers[0].winner, "/low:o");
  EXPECT_EQ(takeovers[0].because, "/low:o became active");
  EXPECT_EQ(takeovers[1].before, "/low:o");
  EXPECT_EQ(takeovers[1].winner, "/high:o");
  EXPECT_EQ(takeovers[1].because, "/high:o became active");
  EXPECT_EQ(takeovers[2].because, "/high:o was deactivated");
  EXPECT_EQ(takeovers[3].winner, "");
  shm::Nanoseconds last = before;
  for (const Takeover& each : takeovers) {
    EXPECT_EQ(each.port, "/p:i");
    EXPECT_GE(each.at, last);  // the arrival itself, not when it was seen
    last = each.at;
  }
  EXPECT_TRUE(sampler_.new_takeovers().empty());
}

TEST_F(TopSampler, SinceIsWhenTheWinnerBegan) {
  Node node("test");
  auto low = node.output_port<int>("/low:o");
  take_census();
  look();
  const shm::Nanoseconds before = shm::monotonic_now();
  low.publish(1);
  const shm::Nanoseconds after = shm::monotonic_now();
  const PortState state = look()->ports.at(0);
  EXPECT_TRUE(state.is_exact);
  EXPECT_GE(state.since, before);
  EXPECT_LE(state.since, after);
  low.publish(2);
  EXPECT_EQ(look()->ports.at(0).since, state.since);  // it has gone on
  Sampler late(instance_);
  take_census(late);
  late.look();
  EXPECT_EQ(late.frame()->ports.at(0).since, state.since);  // as its beginning tells
  low.deactivate();
  look();
  const shm::Nanoseconds again = shm::monotonic_now();
  low.publish(3);
  const shm::Nanoseconds between = shm::monotonic_now();
  low.publish(4);
  const shm::Nanoseconds since = look()->ports.at(0).since;
  EXPECT_GE(since, again);
  EXPECT_LE(since, between);
}

TEST_F(TappingSampler, ATapTellsOfWinnersThatComeAndGoBetweenTwoLooks) {
  low_.publish(1);
  tapping_.look();
  const shm::Nanoseconds first = shm::monotonic_now();
  const shm::Nanoseconds later = first + 3600 * kSecond;  // of what has not been seen yet
  told_ = {
      {"/p:i", "/low:o", first - kSecond, true, 1},  // of what is known already
      {"/p:i", "/high:o", first, true, 1},          {"/p:i", "/low:o", first + 1, true, 1},
      {"/p:i", "/high:o", first + 2, true, 1},      {"/other:i", "/high:o", first + 2, true, 1},
      {"/p:i", "/high:o", later, true, 1}};
  tapping_.look();
  const auto takeovers = tapping_.new_takeovers();
  ASSERT_EQ(takeovers.size(), 4u);
  EXPECT_EQ(takeovers[0].winner, "/high:o");
  EXPECT_EQ(takeovers[0].at, first);
  EXPECT_EQ(takeovers[0].because, "/high:o arrived");
  EXPECT_EQ(takeovers[1].winner, "/low:o");
  EXPECT_EQ(takeovers[2].winner, "/high:o");
  EXPECT_EQ(takeovers[3].before, "/high:o");
  EXPECT_EQ(takeovers[3].winner, "/low:o");  // as the picture has it
}

TEST_F(TopSampler, ATapTellsHowLongTheOldestSampleHasWaitedAtMost) {
  std::vector<Accepted> told;
  Sampler tapping(instance_, [&told] { return std::exchange(told, {}); });
  constexpr shm::Nanoseconds kMs = 1'000'000;
  const shm::Nanoseconds first = shm::monotonic_now() - 11 * kMs;
  Census census;
  census.asked = first + 10 * kMs;
  census.at = first + 11 * kMs;
  census.ports.resize(1);
  census.ports[0].name = "/p:i";
  const auto oldest_of = [&](std::vector<std::pair<std::string, std::uint64_t>> queues) {
    census.ports[0].queues = std::move(queues);
    tapping.set_census(std::make_shared<const Census>(census));
    tapping.look();
    return tapping.frame({{"/p:i", std::nullopt}})->ports.at(0).oldest;
  };
  EXPECT_EQ(oldest_of({{"/low:o", 1}}), std::nullopt);  // accepted before it was tapped
  told = {{"/p:i", "/low:o", first},
          {"/p:i", "/low:o", first + 5 * kMs, false},
          {"/p:i", "/low:o", first + 7 * kMs},
          {"/other:i", "/low:o", first + 9 * kMs},
          {"/p:i", "/low:o", first + 10 * kMs + 1},  // perhaps after the daemon has looked
          {"/p:i", "/high:o", first + 8 * kMs}};
  tapping.look();
  EXPECT_EQ(oldest_of({}), 0);
  EXPECT_EQ(oldest_of({{"/low:o", 1}}), 4 * kMs);
  EXPECT_EQ(oldest_of({{"/low:o", 2}}), 11 * kMs);  // the signal was not queued
  EXPECT_EQ(oldest_of({{"/low:o", 1}, {"/high:o", 1}}), 4 * kMs);
  EXPECT_EQ(oldest_of({{"/low:o", 3}}), std::nullopt);
}

TEST_F(TopSampler, AnotherModelMayChangeTheWinner) {
  Node node("test");
  auto low = node.output_port<int>("/low:o");
  auto high = node.output_port<int>("/high:o");
  low.publish(1);
  high.publish(1);
  take_census();
  EXPECT_EQ(winner_of(*look(), "/p:i"), "/high:o");
  daemon_.load(R"(<behaviors timeout="forever">
    <behavior name="Low"><config at="/p:i">/low:o</config></behavior></behaviors>)");
  instance_->catch_up();
  EXPECT_EQ(winner_of(*look(), "/p:i"), "/low:o");
  const auto takeovers = sampler_.new_takeovers();
  ASSERT_EQ(takeovers.size(), 1u);
  EXPECT_EQ(takeovers[0].because, "model 2 came into force");
}

// Both sources are active before and after.
TEST_F(TappingSampler, ATapDoesNotTakeTheFirstArrivalUnderAnotherModelForTheCause) {
  low_.publish(1);
  high_.publish(1);
  tapping_.look();
  const shm::Nanoseconds first = shm::monotonic_now();
  daemon_.load(R"(<behaviors timeout="forever">
    <behavior name="Low"><config at="/p:i">/low:o</config></behavior>
    <behavior name="High"><config at="/p:i">/high:o</config><condition>not /low:o</condition>
    </behavior></behaviors>)");
  instance_->catch_up();
  told_ = {{"/p:i", "/high:o", first, true, 1},
           {"/p:i", "/low:o", first + 1, true, 2},
           {"/p:i", "/high:o", first + 2, true, 1},   // had been decided before
           {"/p:i", "/high:o", first + 3, true, 3}};  // by what the picture does not know yet
  tapping_.look();
  const auto takeovers = tapping_.new_takeovers();
  ASSERT_EQ(takeovers.size(), 1u);
  EXPECT_EQ(takeovers[0].before, "/high:o");
  EXPECT_EQ(takeovers[0].winner, "/low:o");
  EXPECT_EQ(takeovers[0].at, first + 1);
  EXPECT_EQ(takeovers[0].because, "model 2 came into force");
}

TEST_F(TappingSampler, ATapTellsOfArrivalsUnderAnotherModelThatLeftTheWinner) {
  low_.publish(1);
  tapping_.look();
  const shm::Nanoseconds first = shm::monotonic_now();
  daemon_.load(kModel + "<!-- the same again -->");
  instance_->catch_up();
  high_.publish(1);
  told_ = {{"/p:i", "/low:o", first, true, 2}, {"/p:i", "/high:o", first + 1, true, 2}};
  tapping_.look();
  const auto takeovers = tapping_.new_takeovers();
  ASSERT_EQ(takeovers.size(), 1u);
  EXPECT_EQ(takeovers[0].winner, "/high:o");
  EXPECT_EQ(takeovers[0].because, "/high:o arrived");
}

// Between the picture and what is made of it, eight models take the table's place.
TEST_F(TopSampler, ForgetsWhatItHasReadOfATableThatWasOverwritten) {
  Node node("test");
  auto low = node.output_port<int>("/low:o");
  auto high = node.output_port<int>("/high:o");
  low.publish(1);
  high.publish(1);
  bool is_to_load = false;
  Sampler sampler(instance_, [&] {
    for (int i = 0; is_to_load && i < 8; ++i) {
      daemon_.load(R"(<behaviors timeout="forever">
        <behavior name="Low"><config at="/p:i">/low:o</config><condition>not /other:o</condition>
        </behavior></behaviors>)");
    }
    is_to_load = false;
    return std::vector<Accepted>();
  });
  auto other = node.output_port<int>("/other:o");
  other.signal();
  instance_->catch_up();
  take_census(sampler);
  sampler.look();
  // Of a census without /other:o, and so of a picture without it.
  Census census = *sampler.frame()->census;
  std::erase_if(census.sources, [](const SourceFact& each) { return each.name == "/other:o"; });
  sampler.set_census(std::make_shared<const Census>(census));
  is_to_load = true;
  sampler.look();
  EXPECT_EQ(winner_of(*sampler.frame(), "/p:i"), "/high:o");
  EXPECT_TRUE(sampler.new_takeovers().empty());
  instance_->catch_up();
  sampler.look();
  EXPECT_EQ(winner_of(*sampler.frame(), "/p:i"), "nobody");
}

TEST_F(TopSampler, GoesOnWithoutADaemonAndWithTheNext) {
  Node node("test");
  auto low = node.output_port<int>("/low:o");
  take_census();
  look();
  daemon_.kill();
  test::update_until(*instance_, [this] { return !instance_->has_daemon(); });
  low.publish(1);
  const auto alone = look();
  EXPECT_FALSE(alone->has_daemon);
  EXPECT_EQ(winner_of(*alone, "/p:i"), "/low:o");
  daemon_.restart();
  test::update_until(*instance_, [this] { return instance_->has_daemon(); });
  take_census();
  EXPECT_TRUE(look()->has_daemon);
  EXPECT_EQ(winner_of(*look(), "/p:i"), "/low:o");
}

TEST_F(TopSampler, TellsModelsOfOneNumberApartByTheMemoryOfTheirDaemon) {
  take_census();
  const auto before = look();
  const auto memory = instance_->memory();
  daemon_.kill();
  daemon_.lose_state();
  daemon_.restart();
  test::update_until(*instance_, [&] { return instance_->memory() != memory; });
  take_census();
  const auto after = look();
  EXPECT_EQ(after->generation, before->generation);
  EXPECT_NE(after->memories, before->memories);
}

TEST_F(TopSampler, KnowsWhenWhatTheDaemonCountedIsOld) {
  take_census();
  EXPECT_TRUE(look()->is_counted);
  Census old = *look()->census;
  old.at -= kCensusHolds;
  sampler_.set_census(std::make_shared<const Census>(old));
  EXPECT_FALSE(look()->is_counted);
}

TEST_F(TopSampler, APortThatNoRuleMentionsIsNotArbitrated) {
  Node node("test");
  auto in = node.input_port<int>("/other:i");
  instance_->catch_up();
  take_census();
  EXPECT_EQ(winner_of(*look(), "/other:i"), std::to_string(kNotArbitrated));
}

}  // namespace
}  // namespace arbiter::top
