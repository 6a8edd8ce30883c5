// Who wins at each port, from look to look.
#include "watch/winners.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include <arbiter/arbiter.hpp>

#include "shm/clock.hpp"
#include "tests/watch/watched.hpp"

namespace arbiter::test {
namespace {

std::string model(const std::string& high) {
  return R"(<behaviors timeout="forever">
  <behavior name="Low"><config at="/p">/low</config></behavior>
  <behavior name="High"><config at="/p">)" +
         high + R"(</config><inhibition>Low</inhibition></behavior>
</behaviors>
)";
}

// A daemon tells of pages; a model may be in force before that is taken up, or may never be, where
// the policy does not let us observe any more.
TEST(Winners, AreNotTakenForOthersWhileASourceCannotBeSeen) {
  Daemon daemon(model("/high"));
  Node node("test");
  auto low = node.output_port<int>("/low");
  low.publish(1);
  const auto instance = watched(daemon);
  watch::Winners winners(instance, [](std::string_view) { return true; });
  auto news = winners.look();
  ASSERT_EQ(news.size(), 1u);
  EXPECT_EQ(news[0].winner, "/low");
  auto other = node.output_port<int>("/other");
  other.publish(1);
  low.deactivate();
  daemon.load(model("/other"));
  news = winners.look();
  EXPECT_TRUE(news.empty()) << news[0].winner.value_or("nobody");
  ASSERT_EQ(winners.now().count("/p"), 1u);
  instance->catch_up();
  news = winners.look();
  ASSERT_EQ(news.size(), 1u);
  EXPECT_EQ(news[0].winner, "/other");
  EXPECT_EQ(news[0].before, "/low");
  EXPECT_FALSE(news[0].is_first);
}

// A source that has arrived again since tells of when it began; where two must come together, the
// later one counts.
TEST(Winners, WinSinceTheyBeganHoweverLateThatIsSeen) {
  Daemon daemon(R"(<behaviors timeout="forever">
  <arbiter at="/one"><select from="/low"/></arbiter>
  <arbiter at="/two"><select from="/low">/high</select></arbiter>
</behaviors>
)");
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  const auto instance = watched(daemon);
  watch::Winners winners(instance, [](std::string_view) { return true; });
  ASSERT_EQ(winners.look().size(), 2u);
  low.publish(1);
  const shm::Nanoseconds between = shm::monotonic_now();
  low.publish(2);
  high.publish(1);
  const shm::Nanoseconds after = shm::monotonic_now();
  high.publish(2);
  const auto news = winners.look();
  ASSERT_EQ(news.size(), 2u);
  EXPECT_EQ(news[0].port, "/one");
  EXPECT_LE(news[0].time, between);
  EXPECT_EQ(news[1].port, "/two");
  EXPECT_GE(news[1].time, between);
  EXPECT_LE(news[1].time, after);
}

// Each of the two changes would have been enough: the first was.
TEST(Winners, EndWithTheFirstChangeThatEndsThem) {
  Daemon daemon(R"(<behaviors timeout="forever">
  <arbiter at="/in"><select from="/low">not /stop</select></arbiter>
</behaviors>
)");
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto stop = node.output_port<int>("/stop");
  const auto instance = watched(daemon);
  watch::Winners winners(instance, [](std::string_view) { return true; });
  for (const bool stop_is_first : {true, false}) {
    stop.deactivate();
    low.publish(1);
    winners.look();
    stop_is_first ? static_cast<void>(stop.publish(1)) : low.deactivate();
    const shm::Nanoseconds between = shm::monotonic_now();
    stop_is_first ? low.deactivate() : static_cast<void>(stop.publish(1));
    const auto news = winners.look();
    ASSERT_EQ(news.size(), 1u);
    EXPECT_LE(news[0].time, between);
  }
}

}  // namespace
}  // namespace arbiter::test
