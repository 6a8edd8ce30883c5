// The daemon's state is lost while components live: it cannot take them back, and says so.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;

// The next daemon knows nothing of what the last one did.
void restart_without_state(Daemon& daemon) {
  daemon.kill();
  daemon.lose_state();
  daemon.restart();
}

json strangers(Daemon& daemon) { return daemon.status()["strangers"]; }

// The first of them, once it has said what it has, and at another time than `seen_before`.
json stranger(Daemon& daemon, const json& seen_before = nullptr) {
  for (;;) {
    const json all = strangers(daemon);
    if (all.empty() || all[0]["seen_ns"] == seen_before) continue;
    if (!all[0]["outputs"].empty() || !all[0]["inputs"].empty()) return all[0];
  }
}

std::size_t times(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(Strangers, AreInTheStatusWithTheirPortsForAsLongAsTheyLive) {
  Daemon daemon(single_model());
  EXPECT_EQ(strangers(daemon), json::array());
  Component arm("arm");
  ASSERT_EQ(arm.tell("input /in 8 1 0"), "open");
  ASSERT_EQ(arm.tell("output /out"), "open");
  restart_without_state(daemon);
  const json told = stranger(daemon);
  EXPECT_EQ(told["node"], "arm");
  EXPECT_EQ(told["pid"], arm.process().pid());
  EXPECT_EQ(told["inputs"], json::array({"/in"}));
  EXPECT_EQ(told["outputs"], json::array({"/out"}));
  EXPECT_THAT(told["why"].get<std::string>(), testing::HasSubstr("restart the component"));
  EXPECT_GT(told["since_ns"], 0);
  arm.process().kill();
  EXPECT_EQ(strangers(daemon), json::array());
}

// Whose ports nobody new sees, a supervisor starts again, if it is told.
TEST(Strangers, AreToldThemselves) {
  Daemon daemon(single_model());
  std::promise<Notice> told;
  NodeOptions options;
  options.on_notice = [&](const Notice& notice) {
    if (notice.kind == NoticeKind::apart) told.set_value(notice);
  };
  Node arm("arm", options);
  const auto in = arm.input_port<int>("/in");
  restart_without_state(daemon);
  const Notice notice = told.get_future().get();
  EXPECT_EQ(notice.port, "");
  EXPECT_THAT(notice.text, testing::HasSubstr("components that come now do not see \"arm\""));
  EXPECT_THAT(notice.text, testing::HasSubstr("restart the component"));
}

TEST(Strangers, AreLoggedOnceThoughTheyAskAgainAndAgain) {
  Daemon daemon(single_model());
  Component arm("arm");
  ASSERT_EQ(arm.tell("input /in 8 1 0"), "open");
  restart_without_state(daemon);
  const json first = stranger(daemon);
  const json later = stranger(daemon, first["seen_ns"]);
  EXPECT_EQ(later["since_ns"], first["since_ns"]);
  EXPECT_EQ(strangers(daemon).size(), 1u);
  EXPECT_EQ(times(daemon.log(), "does not know the ports of \"arm\""), 1u) << daemon.log();
}

TEST(Strangers, AreNoneAnyMoreWhenTheyHaveBegunAnew) {
  Daemon daemon(single_model());
  Component arm("arm");
  ASSERT_EQ(arm.tell("input /in 8 1 0"), "open");
  restart_without_state(daemon);
  stranger(daemon);
  ASSERT_EQ(arm.tell("close /in"), "closed");
  await([&] { return strangers(daemon).empty(); });
  ASSERT_EQ(arm.tell("input /in 8 1 0"), "open");
  EXPECT_TRUE(daemon.input("/in")["open"]);
}

}  // namespace
}  // namespace arbiter::test
