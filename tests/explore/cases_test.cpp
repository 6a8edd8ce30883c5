// Each case holds in all interleavings within its limits.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/explore/case.hpp"

namespace arbiter::explore {
namespace {

class Interleavings : public testing::TestWithParam<Case> {};

TEST_P(Interleavings, Hold) {
  const Case& each = GetParam();
  each.body([&](const Explorer::Scenario& scenario) {
    const Report report = Explorer(each.limits).run(scenario);
    EXPECT_EQ(report.failure, "") << report.trace;
    EXPECT_TRUE(report.complete) << "not all interleavings were seen";
    std::printf("%s: %llu interleavings; at most %d preemptions, %d old values, %d halts\n",
                each.name, static_cast<unsigned long long>(report.executions),
                each.limits.preemptions, each.limits.stale_reads, each.limits.halts);
  });
}

INSTANTIATE_TEST_SUITE_P(All, Interleavings, testing::ValuesIn(cases()),
                         [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace arbiter::explore
