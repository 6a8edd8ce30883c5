#include "rules/explain/simulation.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <sstream>

#include "tests/rules/rules_by_hand.hpp"

namespace arbiter::test {
namespace {

using rules::Diagnostics;
using rules::RuleSet;
using rules::Simulation;

std::string simulate(const RuleSet& set, const std::string& trace) {
  Diagnostics diagnostics;
  Simulation simulation(compile(set, diagnostics));
  const auto events = parse_trace(rules::TextFile("trace.csv", trace), diagnostics);
  EXPECT_FALSE(diagnostics.has_errors());
  std::ostringstream out;
  for (const auto& event : events) {
    for (const auto& row : simulation.step(event)) write_outcome(out, row);
  }
  return out.str();
}

RulesByHand override_rules() {
  return RulesByHand().port("/p", {{"/low", inactive("/high")}, {"/high", always()}});
}

TEST(Simulation, IsActiveForAHalfOpenInterval) {
  EXPECT_EQ(
      simulate(override_rules(), "t_ns,source\n0,/high\n0,/low\n499999999,/low\n500000000,/low\n"),
      "0,/high,/p,delivered,/high\n"
      "0,/low,/p,discarded,/high\n"
      "499999999,/low,/p,discarded,/high\n"
      "500000000,/low,/p,delivered,/low\n");
}

TEST(Simulation, ALaterArrivalRestartsTheInterval) {
  EXPECT_EQ(simulate(override_rules(),
                     "t_ns,source\n0,/high\n400000000,/high\n899999999,/low\n900000000,/low\n"),
            "0,/high,/p,delivered,/high\n"
            "400000000,/high,/p,delivered,/high\n"
            "899999999,/low,/p,discarded,/high\n"
            "900000000,/low,/p,delivered,/low\n");
}

TEST(Simulation, ADiscardedSampleKeepsItsSourceActive) {
  EXPECT_EQ(simulate(RulesByHand()
                         .port("/p", {{"/low", inactive("/high")}, {"/high", inactive("/never")}})
                         .port("/q", {{"/watch", active("/low")}}),
                     "t_ns,source\n0,/high\n300000000,/low\n700000000,/watch\n800000000,/watch\n"),
            "0,/high,/p,delivered,/high\n"
            "300000000,/low,/p,discarded,/high\n"
            "300000000,/low,/q,discarded,-\n"
            "700000000,/watch,/q,delivered,/watch\n"
            "800000000,/watch,/q,discarded,-\n");
}

TEST(Simulation, SourcesHaveTimeoutsOfTheirOwn) {
  EXPECT_EQ(simulate(override_rules().timeout("/high", 10).timeout("/low", shm::kForever),
                     "t_ns,source\n5,/low\n6,/high\n15,\n16,\n2305843009213693951,\n"),
            "5,/low,/p,delivered,/low\n"
            "6,/high,/p,delivered,/high\n"
            "15,-,/p,-,/high\n"
            "16,-,/p,-,/low\n"
            "2305843009213693951,-,/p,-,/low\n");
}

TEST(Simulation, ADeactivationEndsAnActivityAtOnceAndShowsEachPort) {
  EXPECT_EQ(simulate(override_rules().port("/q", {{"/x", always()}}),
                     "t_ns,source,event\n0,/low,\n0,/high,\n1,/high,deactivate\n1,/low,\n"),
            "0,/low,/p,delivered,/low\n"
            "0,/high,/p,delivered,/high\n"
            "1,/high,/p,-,/low\n"
            "1,/high,/q,-,-\n"
            "1,/low,/p,delivered,/low\n");
}

TEST(Simulation, AnArrivalAtTheTimeOfADeactivationCounts) {
  EXPECT_EQ(
      simulate(override_rules(), "t_ns,source,event\n9,/high,\n9,/high,deactivate\n9,/high,\n"),
      "9,/high,/p,delivered,/high\n"
      "9,/high,/p,-,-\n"
      "9,/high,/p,delivered,/high\n");
}

TEST(Simulation, APortThatOnlySensesTheSourceDiscards) {
  EXPECT_EQ(simulate(RulesByHand().port("/p", {{"/a", inactive("/stop")}}),
                     "t_ns,source\n0,/a\n1,/stop\n"),
            "0,/a,/p,delivered,/a\n"
            "1,/stop,/p,discarded,-\n");
}

TEST(Simulation, AConnectionWithoutARuleIsDiscardedYetSeen) {
  EXPECT_EQ(simulate(RulesByHand().port("/p", {{"/a", inactive("/x")}}).other("/x", "/p"),
                     "t_ns,source\n0,/x\n1,/a\n"),
            "0,/x,/p,discarded,-\n"
            "1,/a,/p,discarded,-\n");
}

TEST(Simulation, PortsThatNoRuleMentionsHaveNoRows) {
  EXPECT_EQ(
      simulate(
          RulesByHand().port("/p", {{"/a", always()}}).other("/a", "/open").other("/b", "/open"),
          "t_ns,source\n0,/a\n1,/b\n2,\n"),
      "0,/a,/p,delivered,/a\n"
      "2,-,/p,-,/a\n");
}

TEST(Simulation, ArrivalsOfAnUnknownSourceProduceNothing) {
  EXPECT_EQ(simulate(override_rules(), "t_ns,source,event\n0,/who,\n1,/who,\n"), "");
}

TEST(Simulation, ListsPortsInByteOrderWhateverTheOrderOfTheModel) {
  EXPECT_EQ(simulate(RulesByHand()
                         .port("/b", {{"/s", always()}})
                         .port("/Z", {{"/s", always()}})
                         .port("/a", {{"/s", always()}}),
                     "t_ns,source\n0,/s\n"),
            "0,/s,/Z,delivered,/s\n0,/s,/a,delivered,/s\n0,/s,/b,delivered,/s\n");
}

TEST(Simulation, QuotesNamesInItsOutput) {
  EXPECT_EQ(
      simulate(RulesByHand().port("/a, b", {{"/x,y", always()}}), "t_ns,source\n0,\"/x,y\"\n"),
      "0,\"/x,y\",\"/a, b\",delivered,\"/x,y\"\n");
}

// Section 3 of the semantics, word for word, on plain containers.
class NaiveArbiter {
 public:
  explicit NaiveArbiter(const RuleSet& set) : set_(set) {}

  void arrive(const std::string& source, shm::Nanoseconds at) {
    const auto own = set_.timeouts.find(source);
    const auto timeout = own == set_.timeouts.end() ? set_.timeout : own->second;
    ends_[source] = timeout == shm::kForever ? shm::kForever : at + timeout;
  }
  void deactivate(const std::string& source) { ends_.erase(source); }

  std::string winner(const rules::PortRules& port, shm::Nanoseconds now) const {
    std::set<std::string> active;
    for (const auto& [source, end] : ends_) {
      if (now < end) active.insert(source);
    }
    for (const auto& rule : port.rules) {
      if (holds(rule, active)) return rule.source;
    }
    return "";
  }

 private:
  const RuleSet& set_;
  std::map<std::string, shm::Nanoseconds> ends_;
};

TEST(Simulation, AgreesWithANaiveArbiterOnRandomTraces) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto name = [&] { return "/s" + std::to_string(random() % 6); };
    RulesByHand by_hand;
    for (int p = 0; p < 3; ++p) {
      std::vector<std::pair<std::string, ExpressionPtr>> rules;
      std::set<std::string> sources{name(), name(), name()};
      for (const auto& source : sources) {
        rules.emplace_back(source, any_of({binary(Operator::kXor, active(name()), active(name())),
                                           inactive(name())}));
      }
      by_hand.port("/p" + std::to_string(p), rules, true);
    }
    by_hand.timeout("/s0", 7).timeout("/s1", 30).timeout("/s2", 1).timeout("/s3", shm::kForever);
    RuleSet set = by_hand;
    set.timeout = 12;
    Diagnostics diagnostics;
    Simulation simulation(compile(set, diagnostics));
    NaiveArbiter naive(set);
    rules::TraceEvent event;
    for (int step = 0; step < 400; ++step) {
      event.at += static_cast<shm::Nanoseconds>(random() % 5);
      event.source = name();
      event.kind = random() % 5 == 0 ? rules::TraceKind::kDeactivation : rules::TraceKind::kArrival;
      if (!simulation.knows(event.source)) continue;
      if (event.kind == rules::TraceKind::kArrival) {
        naive.arrive(event.source, event.at);
      } else {
        naive.deactivate(event.source);
      }
      for (const auto& row : simulation.step(event)) {
        const auto port = std::find_if(set.ports.begin(), set.ports.end(),
                                       [&](const auto& p) { return p.port == row.port; });
        const auto winner = naive.winner(*port, event.at);
        EXPECT_EQ(row.outcome.winner, winner);
        EXPECT_EQ(row.outcome.delivered,
                  event.kind == rules::TraceKind::kArrival && winner == event.source);
      }
    }
  }
}

}  // namespace
}  // namespace arbiter::test
