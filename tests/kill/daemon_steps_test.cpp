// The daemon is killed at each of its own steps, at each passing of it: whenever something is half
// done. Samples must go on without it; under its successor nobody may have two writers, the model
// is the one before or the one after, all that was asked for is done, and so is what is asked next.
//
// check_steps holds this table to the sources: a step that is named there has a row here.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cctype>
#include <cstdio>
#include <map>
#include <ostream>
#include <string>
#include <vector>

#include "tests/kill/daemon_scene.hpp"

namespace arbiter::test {
namespace {

struct Step {
  const char* name;
  const char* action;  // in which it is passed
};

struct Action {
  DaemonScene::Options options{};
  bool (*act)(DaemonScene&);
};

const std::map<std::string, Action>& actions() {
  static const std::map<std::string, Action> all{
      {"starts", {{.has_survivors = false}, [](DaemonScene& scene) { return scene.start(); }}},
      {"starts and stores",
       {{.stores = true, .has_survivors = false},
        [](DaemonScene& scene) { return scene.start(); }}},
      {"takes over", {{}, [](DaemonScene& scene) { return scene.take_over(); }}},
      // Its predecessor's store has gone, and with it each page that no component has.
      {"takes over without a store",
       {{.stores = true}, [](DaemonScene& scene) { return scene.take_over(); }}},
      {"stops", {{}, [](DaemonScene& scene) { return scene.stop(); }}},
      {"stops alone", {{.has_survivors = false}, [](DaemonScene& scene) { return scene.stop(); }}},
      {"reloads", {{}, [](DaemonScene& scene) { return scene.reload(); }}},
      {"opens an output", {{}, [](DaemonScene& scene) { return scene.ask({"output /fresh:o"}); }}},
      {"takes what yields",
       {{.yields = true}, [](DaemonScene& scene) { return scene.ask({"output /fresh:o"}); }}},
      {"opens an input", {{}, [](DaemonScene& scene) { return scene.ask({"input /late:i"}); }}},
      {"closes an output",
       {{},
        [](DaemonScene& scene) {
          return scene.ask({"output /fresh:o", "close /fresh:o", "input /late:i"});
        }}},
      {"closes an input",
       {{},
        [](DaemonScene& scene) {
          return scene.ask({"input /late:i", "close /late:i", "output /fresh:o"});
        }}},
      // Names that no model has: they are made, and forgotten.
      {"names an output",
       {{},
        [](DaemonScene& scene) {
          return scene.ask({"output /extra:o", "close /extra:o", "output /fresh:o"});
        }}},
      {"names an input",
       {{},
        [](DaemonScene& scene) {
          return scene.ask({"input /extra:i", "close /extra:i", "output /fresh:o"});
        }}},
      {"names and stores",
       {{.stores = true}, [](DaemonScene& scene) { return scene.ask({"output /extra:o"}); }}},
      // A source that another user has had gets another page.
      {"changes a page",
       {{.by_stranger = true}, [](DaemonScene& scene) { return scene.ask({"output /fresh:o"}); }}},
      {"changes and stores a page",
       {{.stores = true, .by_stranger = true},
        [](DaemonScene& scene) { return scene.ask({"output /fresh:o"}); }}},
  };
  return all;
}

const std::vector<Step> kSteps{
    {"state-drafted", "starts"},
    {"state-replaced", "starts"},
    {"model-named", "starts"},
    {"first-page-registered", "starts"},
    {"table-in-force", "starts"},
    {"store-half-emptied", "starts and stores"},
    {"store-emptied", "starts and stores"},
    {"board-stored", "starts and stores"},
    {"registry-stored", "starts and stores"},

    {"board-taken-up", "takes over"},
    {"registry-taken-up", "takes over"},
    {"names-restored", "takes over"},
    {"node-known-again", "takes over"},
    {"output-readmitted", "takes over"},
    {"input-readmitted", "takes over"},
    {"claims-settled", "takes over"},
    {"state-drafted", "takes over"},
    {"state-replaced", "takes over"},
    {"lost-page-registered", "takes over"},
    {"lost-page-numbered", "takes over"},
    {"lost-page-replaced", "takes over"},
    {"lost-page-stored", "takes over without a store"},
    {"about-to-serve", "takes over"},
    {"model-named", "takes over"},
    {"table-in-force", "takes over"},

    {"component-written-down", "opens an output"},
    {"page-given", "opens an output"},
    {"output-owner-registered", "opens an output"},
    {"output-open", "opens an output"},
    {"publisher-introduced", "opens an output"},
    {"receiver-introduced", "opens an output"},
    {"segments-shown", "opens an output"},
    {"peers-ready", "opens an output"},
    {"holder-asked-to-yield", "takes what yields"},
    {"peers-told-of-the-end", "takes what yields"},
    {"output-owner-cleared", "takes what yields"},
    {"output-open", "takes what yields"},
    {"input-owner-registered", "opens an input"},
    {"input-open", "opens an input"},
    {"publisher-introduced", "opens an input"},
    {"receiver-introduced", "opens an input"},
    {"peers-ready", "opens an input"},

    {"peers-told-of-the-end", "closes an output"},
    {"output-owner-cleared", "closes an output"},
    {"peers-told-of-the-end", "closes an input"},
    {"input-owner-cleared", "closes an input"},

    {"first-page-registered", "names an output"},
    {"first-page-numbered", "names an output"},
    {"source-named", "names an output"},
    {"source-forgotten", "names an output"},
    {"input-named", "names an input"},
    {"input-forgotten", "names an input"},
    {"first-page-stored", "names and stores"},

    {"next-page-made", "changes a page"},
    {"next-page-shown", "changes a page"},
    {"next-page-registered", "changes a page"},
    {"page-changed", "changes a page"},
    {"page-change-rung", "changes a page"},
    {"next-page-stored", "changes and stores a page"},
    {"page-changed", "changes and stores a page"},
    {"former-page-discarded", "changes and stores a page"},

    {"model-named", "reloads"},
    {"table-written", "reloads"},
    {"links-made-ahead", "reloads"},
    {"table-in-force", "reloads"},
    {"links-made-late", "reloads"},
    {"publisher-disconnected", "reloads"},
    {"receiver-disconnected", "reloads"},
    {"all-rung", "reloads"},
    {"change-remembered", "reloads"},

    {"socket-removed", "stops"},
    {"socket-removed", "stops alone"},
    {"state-removed", "stops alone"},
};

class TheDaemonKilledAt : public testing::TestWithParam<Step> {};

TEST_P(TheDaemonKilledAt, LeavesAllToItsSuccessor) {
  constexpr unsigned kMostPassings = 12;
  const Action& action = actions().at(GetParam().action);
  if (action.options.by_stranger && ::geteuid() != 0) {
    GTEST_SKIP() << "only root can start processes of other users";
  }
  for (unsigned passing = 0; passing < kMostPassings && !HasFailure(); ++passing) {
    SCOPED_TRACE("passing " + std::to_string(passing));
    DaemonScene scene(action.options);
    scene.die_at(GetParam().name, passing);
    if (action.act(scene)) {
      scene.live_on();
      EXPECT_NE(passing, 0u) << "whoever " << GetParam().action << " does not pass this step";
      return;
    }
    scene.require_flow();
    scene.require_all_is_well();
    if (HasFailure()) std::printf("%s\n", scene.log().c_str());
  }
}

std::string in_identifier(std::string text) {
  std::string result;
  bool begins = true;
  for (const char c : text) {
    const bool is_letter = std::isalnum(static_cast<unsigned char>(c)) != 0;
    if (is_letter) result += begins ? static_cast<char>(std::toupper(c)) : c;
    begins = !is_letter;
  }
  return result;
}

void PrintTo(const Step& step, std::ostream* out) { *out << step.name; }

INSTANTIATE_TEST_SUITE_P(All, TheDaemonKilledAt, testing::ValuesIn(kSteps), [](const auto& its) {
  return in_identifier(its.param.name) + "WhenItOrAClient" + in_identifier(its.param.action);
});

}  // namespace
}  // namespace arbiter::test
