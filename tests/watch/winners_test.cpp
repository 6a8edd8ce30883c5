// Who wins at each port, from look to look.
#include "watch/winners.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include <arbiter/arbiter.hpp>

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

}  // namespace
}  // namespace arbiter::test
