// What a link knows of its own host, and when: link/host_view.hpp.
#include "link/host_view.hpp"

#include <gtest/gtest.h>

#include "tests/client/models.hpp"
#include "tests/link/robot.hpp"

namespace arbiter::test {
namespace {

// Until then, samples that are too old by the new model would be let in; and to ask the daemon what
// is open may take a second.
TEST(HostView, KnowsAgesOfANewModelBeforeItAsksTheDaemon) {
  Daemon daemon(motor_model("1000s"));
  link::HostView view("", std::nullopt);
  std::uint64_t generation = 0;
  await([&] {
    view.update([] {});
    generation = view.model().generation;
    return generation != 0;
  });
  EXPECT_EQ(view.wanted().at(kPlanner), 1'000'000'000'000);
  daemon.load(motor_model("200ms"));
  bool is_known_first = false;
  await([&] {
    view.update([&] {
      if (view.model().generation != generation) return;
      is_known_first = is_known_first || view.wanted().at(kPlanner) == 200'000'000;
    });
    return view.model().generation != generation;
  });
  EXPECT_TRUE(is_known_first);
}

// Or the log would say it again every other second.
TEST(HostView, SaysThatTheDaemonDoesNotAnswerUntilItDoes) {
  Daemon daemon(motor_model("1000s"));
  link::HostView view("", std::nullopt);
  const auto look = [&] {
    view.update([] {});
    return view.obstacle().empty();
  };
  await(look);
  daemon.process().stop();
  await([&] { return !look(); });
  EXPECT_FALSE(look()) << "between two questions";
  daemon.process().resume();
  await(look);
}

}  // namespace
}  // namespace arbiter::test
