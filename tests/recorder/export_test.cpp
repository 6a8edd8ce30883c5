// `arbiter recording export`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cli/arbiter_program.hpp"
#include "tests/evidence/incident.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

TEST(Export, WritesATraceThatSimulateReads) {
  const TemporaryDirectory directory;
  Incident incident;
  incident.state("/low", 0, 995, shm::arrival(800, 500));  // active already
  incident.arrive("/high", 1100, 1101, Incident::Fate::accepted);
  incident.arrive("/low", 1120, 1121, Incident::Fate::discarded);
  incident.deactivate("/high", 1150, 1151);
  incident.arrive("/low", 1200, 1201, Incident::Fate::accepted);
  const std::string trace = directory.file("trace.csv");
  const std::string csv = directory.file("decisions.csv");
  const auto result =
      arbiter({"recording", "export", incident.file(), "--trace", trace, "--csv", csv});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(content_of(trace),
            "t_ns,source,event\n800,/low,arrive\n1100,/high,arrive\n1120,/low,arrive\n"
            "1150,/high,deactivate\n1200,/low,arrive\n");
  EXPECT_EQ(content_of(csv),
            "t_ns,source,destination,decision,winner\n1100,/high,/p,delivered,/high\n"
            "1120,/low,/p,discarded,/high\n1200,/low,/p,delivered,/low\n");
  // What simulate makes of the trace has the same decisions in it.
  const auto simulated =
      arbiter({"simulate", directory.write("model.xml", kOverride), "--trace", trace});
  EXPECT_EQ(simulated.out,
            "t_ns,source,destination,decision,winner\n800,/low,/p,delivered,/low\n"
            "1100,/high,/p,delivered,/high\n1120,/low,/p,discarded,/high\n1150,/high,/p,-,/low\n"
            "1200,/low,/p,delivered,/low\n");
}

TEST(Export, NeedsToKnowWhat) {
  Incident incident;
  EXPECT_EQ(arbiter({"recording", "export", incident.file()}).exit_code, 2);
}

}  // namespace
}  // namespace arbiter::test
