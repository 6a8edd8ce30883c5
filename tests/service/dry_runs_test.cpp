// What a change of the model would do, told before it is made.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/service/changing_models.hpp"

namespace arbiter::test {
namespace {

TEST_F(ChangingModels, ADryRunOfARollbackSaysWhereToAndWhatChanges) {
  Daemon& daemon = start();
  daemon.load(only("b"));
  daemon.load(only("c"));
  const auto result = arbiter({"rollback", "--dry-run"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, testing::StartsWith("back to model 2: default " + daemon.directory() +
                                              "/model.xml (reload)\n"));
  EXPECT_THAT(result.out, testing::HasSubstr("/in"));
  EXPECT_THAT(result.out,
              testing::EndsWith("\nthis was a dry run: arbiter rollback 2 puts that model in "
                                "force\n"));
  const auto dry = nlohmann::json::parse(arbiter({"rollback", "1", "--dry-run", "--json"}).out);
  expect_refusal(arbiter({"rollback", "9", "--dry-run"}),
                 "model 9 is not in the history; arbiter history shows what is");
  EXPECT_EQ(daemon.generation(), 3u);
  EXPECT_EQ(source_in_force(), "/c");
  const auto done = nlohmann::json::parse(arbiter({"rollback", "1", "--json"}).out);
  EXPECT_EQ(dry["back_to"], done["back_to"]);
  EXPECT_EQ(dry["models"][0]["changes"], done["changes"]);
  EXPECT_EQ(dry["models"][0]["in_force"], false);
}

}  // namespace
}  // namespace arbiter::test
