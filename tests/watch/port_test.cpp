// A port that is watched: one look, what explains it, and the model in force.
#include "watch/port.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>

#include <arbiter/arbiter.hpp>

#include "tests/support/error_of.hpp"
#include "tests/watch/watched.hpp"
#include "watch/model_loader.hpp"
#include "watch/obstacles.hpp"

namespace arbiter::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const std::string kGazeModel = R"(<behaviors timeout="3600s">
  <source port="/low" timeout="forever"/>
  <behavior name="Low"><config at="/p">/low</config></behavior>
  <behavior name="High"><config at="/p">/high</config><inhibition>Low</inhibition></behavior>
</behaviors>
)";

TEST(WatchedPort, IsSeenWithAllThatMattersToIt) {
  Daemon daemon(kGazeModel);
  Node node("component");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  watch::Port port(watched(daemon), "/p");
  low.signal();
  watch::Look look = port.look();
  EXPECT_TRUE(look.is_arbitrated && look.is_mentioned);
  EXPECT_EQ(look.generation(), 1u);
  EXPECT_EQ(port.source_name(look.winner), "/low");
  EXPECT_TRUE(look.sources.is_active("/low"));
  EXPECT_EQ(look.sources.state("/low").timeout, shm::kForever);
  EXPECT_EQ(look.picture.next_end(), shm::kForever);
  high.signal();
  look = port.look();
  EXPECT_EQ(port.source_name(look.winner), "/high");
  EXPECT_EQ(look.picture.next_end(),
            *look.sources.state("/high").last_arrival() + look.sources.state("/high").timeout);
}

TEST(WatchedPort, IsExplainedByTheModelOfTheLook) {
  Daemon daemon(kGazeModel);
  Node node("component");
  auto high = node.output_port<int>("/high");
  watch::Port port(watched(daemon), "/p");
  high.signal();
  const watch::Look before = port.look();
  const auto explanation = port.explain(before);
  ASSERT_TRUE(explanation);
  EXPECT_EQ(explanation->winner, "/high");
  EXPECT_EQ(port.model().generation(), 1u);
  EXPECT_THAT(port.known_sources(), ElementsAre("/high", "/low"));
  daemon.load("<behaviors><arbiter at='/p'><select from='/high'/></arbiter></behaviors>");
  const watch::Look after = port.look();
  ASSERT_TRUE(port.explain(after));
  EXPECT_FALSE(port.explain(before)) << "the daemon does not have that model's texts any more";
  EXPECT_THAT(port.known_sources(), ElementsAre("/high"));
}

TEST(WatchedPort, IsExplainedAsItWasInAPictureThatWasKept) {
  Daemon daemon(kGazeModel);
  Node node("component");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  watch::Port port(watched(daemon), "/p");
  low.signal();
  const watch::Look then = port.look();
  watch::KeptPicture kept{then.generation(), then.picture.now, {}};
  for (const char* name : {"/low", "/high"}) kept.words[name] = then.sources.state(name).word;
  high.signal();
  EXPECT_EQ(port.source_name(port.look().winner), "/high");
  const watch::Look back = port.look_back(kept);
  EXPECT_EQ(port.source_name(back.winner), "/low");
  EXPECT_EQ(back.sources.now(), then.sources.now());
  const auto explanation = port.explain(back);
  ASSERT_TRUE(explanation);
  EXPECT_EQ(explanation->winner, "/low");
  kept.words.erase("/low");
  const watch::Look without = port.look_back(kept);
  EXPECT_EQ(without.winner, shm::kNone);
  EXPECT_FALSE(without.sources.state("/low").is_visible);
  daemon.load(kGazeModel);
  EXPECT_THAT(error_of([&] { static_cast<void>(port.look_back(kept)); }),
              HasSubstr("another model has come into force since"));
}

TEST(WatchedPort, ThatNobodyHasNamedIsRefusedWithAdvice) {
  Daemon daemon(kGazeModel);
  const auto instance = watched(daemon);
  EXPECT_THAT(error_of([&] { watch::Port(instance, "/P"); }),
              testing::AllOf(HasSubstr("has named the input port /P"), HasSubstr("/p")));
  EXPECT_THAT(error_of([&] { watch::Port(instance, "/low"); }),
              HasSubstr("has named the input port /low"));
}

TEST(WatchedPort, OfADaemonThatHasMemoryOfItsOwnIsSeenNoMore) {
  Daemon daemon(kGazeModel);
  const auto instance = watched(daemon);
  const watch::Port port(instance, "/p");
  const auto memory = instance->memory();
  daemon.kill();
  EXPECT_EQ(port.look().winner, shm::kNone);
  daemon.lose_state();
  daemon.restart();
  update_until(*instance, [&] { return instance->memory() != memory; });
  EXPECT_THAT(error_of([&] { static_cast<void>(port.look()); }),
              HasSubstr("another daemon has started without the memory of the last one"));
}

TEST(WatchedPort, IsNotExplainedByTheModelOfADaemonThatHasMemoryOfItsOwn) {
  Daemon daemon(kGazeModel);
  watch::Port port(watched(daemon), "/p");
  const watch::Look look = port.look();
  daemon.kill();
  daemon.lose_state();
  daemon.restart();
  EXPECT_THAT(error_of([&] { static_cast<void>(port.explain(look)); }),
              HasSubstr("another daemon has started without the memory of the last one"));
}

TEST(WatchedPort, KnowsWhetherTheTableOfALookHasBeenOverwritten) {
  Daemon daemon(kGazeModel);
  const watch::Port port(watched(daemon), "/p");
  const watch::Look look = port.look();
  daemon.load(kGazeModel);
  EXPECT_TRUE(port.is_whole(look.picture.snapshot));
  for (std::uint32_t i = 1; i < shm::kTableSlots; ++i) daemon.load(kGazeModel);
  EXPECT_FALSE(port.is_whole(look.picture.snapshot));
}

TEST(WatchedPort, SharesTheModelWithOtherPorts) {
  Daemon daemon(
      "<behaviors><arbiter at='/p'><select from='/a'/></arbiter>"
      "<arbiter at='/q'><select from='/a'/></arbiter></behaviors>");
  const auto instance = watched(daemon);
  const auto models = std::make_shared<watch::ModelLoader>(instance);
  watch::Port p(instance, "/p", models);
  watch::Port q(instance, "/q", models);
  const auto model_of = [](watch::Port& port) {
    EXPECT_TRUE(port.explain(port.look()));
    return &port.model();
  };
  const auto* first = model_of(p);
  EXPECT_EQ(model_of(q), first);
  daemon.load("<behaviors><arbiter at='/p'><select from='/b'/></arbiter></behaviors>");
  const auto* second = model_of(p);
  EXPECT_EQ(second->generation(), 2u);
  EXPECT_EQ(q.model().generation(), 1u) << "it has not been explained since";
  EXPECT_EQ(model_of(q), second);
}

// It may know less of the model than the last one.
TEST(WatchedModel, IsLoadedAnewFromAnotherDaemon) {
  Daemon daemon(kGazeModel);
  Node node("component");  // who hands the memory on
  auto low = node.output_port<int>("/low");
  const auto instance = watched(daemon);
  watch::ModelLoader models(instance);
  const auto first = models.load(1);
  EXPECT_TRUE(first->in_force.has_texts());
  EXPECT_EQ(models.load(1), first);
  daemon.kill();
  daemon.restart_without_model();
  update_until(*instance, [&] { return instance->daemons() == 2; });
  const auto second = models.load(1);
  EXPECT_EQ(second->in_force.generation(), 1u);
  EXPECT_FALSE(second->in_force.has_texts());
}

TEST(WatchedPort, KnowsWhatKeepsSamplesFromIt) {
  Daemon daemon(kGazeModel);
  Node node("component");
  auto low = node.output_port<int>("/low");
  low.signal();
  const auto instance = watched(daemon);
  watch::Port port(instance, "/p");
  const watch::Look look = port.look();
  ASSERT_TRUE(port.explain(look));
  const wire::Status status = instance->status();
  const watch::Obstacles obstacles(status, "/p", look.sources, port.known_sources(),
                                   port.known_ports());
  const auto of_port = obstacles.of_port();
  ASSERT_EQ(of_port.size(), 1u);
  EXPECT_STREQ(of_port[0].code, "port-not-open");
  EXPECT_EQ(obstacles.component_of("/low"), "component (pid " + std::to_string(::getpid()) + ")");
  EXPECT_TRUE(obstacles.is_out_of_use("/high"));
}

}  // namespace
}  // namespace arbiter::test
