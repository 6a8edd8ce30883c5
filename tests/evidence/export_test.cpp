// Recordings as traces.
#include "evidence/export.hpp"

#include <gtest/gtest.h>

#include <sstream>

#include "evidence/comparison.hpp"
#include "tests/evidence/incident.hpp"

namespace arbiter::test {
namespace {

using Fate = Incident::Fate;

std::string trace_of(Incident& incident) {
  evidence::Models models(compile_texts);
  std::ostringstream out;
  evidence::write_trace(incident.read(), models, out);
  return out.str();
}

// Taps tell of a memory before the recorder notices that it is a new one, and begins again with
// what is active in it.
void add_restart(Incident& incident) {
  incident.arrive("/high", 1010, 1011, Fate::accepted);
  incident.arrive("/low", 1020, 1021, Fate::discarded);
  incident.arrive("/low", 1210, 1211, Fate::accepted);
  incident.arrive("/high", 1230, 1231, Fate::accepted);
  incident.add(evidence::Start{1250, "test", {}, "none"});
  incident.state("/low", 0, 1249, shm::arrival(1210, 500));
  incident.state("/high", 0, 1249, shm::arrival(1230, 500));
  incident.put_in_force(kOverride, 1, 1200);
  incident.arrive("/low", 1260, 1261, Fate::discarded);
}

TEST(Trace, HasWhatTwoMemoriesTellOnceAndInOrder) {
  Incident incident;
  add_restart(incident);
  EXPECT_EQ(trace_of(incident),
            "t_ns,source,event\n1010,/high,arrive\n1020,/low,arrive\n1210,/low,arrive\n"
            "1230,/high,arrive\n1260,/low,arrive\n");
}

TEST(Trace, GoesBackToNoTimeBeforeTheMemoryBefore) {
  Incident incident;
  incident.arrive("/low", 1240, 1241, Fate::accepted);
  incident.add(evidence::Start{1250, "test", {}, "none"});
  incident.state("/high", 1100, 1249, shm::kForeverFlag | 1100);
  incident.add(evidence::ModelChange{});
  incident.arrive("/low", 1260, 1261, Fate::none);
  EXPECT_EQ(trace_of(incident),
            "t_ns,source,event\n1240,/low,arrive\n1240,/high,arrive\n1260,/low,arrive\n");
}

TEST(Trace, OfTheMemoryBeforeNamesNoWinnerOfTheNext) {
  Incident incident;
  incident.arrive("/low", 1100, 1101, Fate::accepted);
  incident.arrive("/high", 1210, 1211, Fate::accepted);
  incident.add(evidence::Start{1250, "test", {}, "none"});
  incident.put_in_force(kOverride, 1, 1200);
  const auto recorded = incident.read();
  evidence::Models models(compile_texts);
  const auto winners = evidence::winners_of(recorded.runs.front(), models);
  ASSERT_FALSE(winners.empty());
  EXPECT_EQ(winners.back().winner, "/low");
}

}  // namespace
}  // namespace arbiter::test
