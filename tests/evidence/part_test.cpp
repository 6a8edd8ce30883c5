// A part of a recording: what it says is what the whole says of that time.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "evidence/comparison.hpp"
#include "evidence/export.hpp"
#include "evidence/record_reader.hpp"
#include "evidence/verification.hpp"
#include "tests/evidence/incident.hpp"

namespace arbiter::test {
namespace {

using evidence::Recorded;
using evidence::TimeSpan;
using evidence::Verification;
using Fate = Incident::Fate;

Recorded read_part(Incident& incident, TimeSpan part) {
  return evidence::load_recording(incident.file(), {}, evidence::Wanted::all, part);
}

constexpr shm::Nanoseconds kMs = 1'000'000;

std::string slowed(std::string model) { return model.replace(model.find("500ns"), 5, "25s"); }
constexpr shm::Nanoseconds kT = 25'000 * kMs;

// Each source tells its steps in order, some of them late, by at most 6 s; models come, events are
// missing, and the recording begins again.
void fill(Incident& incident, std::mt19937& random, shm::Nanoseconds until) {
  const auto below = [&](unsigned most) { return static_cast<shm::Nanoseconds>(random() % most); };
  const auto some = [&](unsigned most) { return below(most) * 50 * kMs; };
  std::uint64_t generation = 1;
  shm::Nanoseconds time = 1000;
  while (time < until) {
    time += 1 + some(60);
    const std::string source = below(2) == 0 ? "/low" : "/high";
    const shm::Nanoseconds seen = time + some(120);
    switch (below(24)) {
      case 0:
        incident.deactivate(source, time, seen);
        break;
      case 1:
        incident.state(source, time, seen, shm::arrival(time, kT), evidence::SourceState::Why::gap,
                       2);
        break;
      case 2:
        incident.put_in_force(slowed(generation % 2 == 0 ? kOverride : kReversed), generation + 1,
                              time);
        ++generation;
        break;
      case 3:
        incident.add(evidence::Start{time, "test", {}, "none"});
        for (const char* const each : {"/low", "/high"}) {
          incident.state(each, 0, time, shm::kNeverActive);
        }
        incident.put_in_force(slowed(kOverride), generation, time);
        break;
      default:
        incident.arrive(source, time, seen, below(2) == 0 ? Fate::accepted : Fate::discarded, kT);
    }
  }
}

using Counts = std::array<std::uint64_t, 6>;

Counts counts_of(const Recorded& recorded) {
  evidence::Models models(compile_texts);
  const Verification result = verify(recorded, models);
  return {result.equal,      result.overlapped,    result.blind,
          result.behind_gap, result.without_model, result.different};
}

using Names = std::vector<std::tuple<shm::Nanoseconds, std::string, std::uint64_t>>;

Names names_of(const Recorded& recorded) {
  Names names;
  for (const evidence::Run& run : recorded.runs) {
    for (const evidence::Decision& each : run.decisions) {
      names.emplace_back(each.arrival().time, each.context->source, each.sequence);
    }
  }
  return names;
}

TEST(PartOfARecording, HasTheSameOfEachDecisionAsTheWhole) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Incident incident(slowed(kOverride));
    fill(incident, random, 250'000 * kMs);
    std::vector<shm::Nanoseconds> cuts{0, shm::kForever};
    for (int i = 0; i < 3; ++i) cuts.push_back(static_cast<int>(random() % 260'000) * kMs);
    std::sort(cuts.begin(), cuts.end());
    Counts sum{};
    Names names;
    for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
      const Recorded part = read_part(incident, {cuts[i], cuts[i + 1]});
      const Counts counts = counts_of(part);
      for (std::size_t k = 0; k < counts.size(); ++k) sum[k] += counts[k];
      for (auto& name : names_of(part)) names.push_back(std::move(name));
    }
    const Recorded whole = incident.read();
    EXPECT_EQ(sum, counts_of(whole));
    EXPECT_EQ(names, names_of(whole));
  }
}

// Rows of one moment may change places.
std::multiset<std::string> decided_rows(const Recorded& recorded) {
  evidence::Models models(compile_texts);
  std::stringstream text;
  evidence::write_decisions(recorded, models, text);
  std::string row;
  std::getline(text, row);  // the names of the columns
  std::multiset<std::string> rows;
  while (std::getline(text, row)) rows.insert(row);
  return rows;
}

TEST(PartOfARecording, HasTheSameRowsAsTheWhole) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Incident incident(slowed(kOverride));
    fill(incident, random, 150'000 * kMs);
    const shm::Nanoseconds cut = static_cast<int>(random() % 150'000) * kMs;
    auto rows = decided_rows(read_part(incident, {0, cut}));
    rows.merge(decided_rows(read_part(incident, {cut, shm::kForever})));
    EXPECT_EQ(rows, decided_rows(incident.read()));
  }
}

TEST(PartOfARecording, HasOneStateOfWhatASourceDidBefore) {
  Incident incident;
  for (int i = 0; i < 100; ++i) incident.arrive("/low", 1010 + i, 1011 + i, Fate::accepted);
  incident.arrive("/low", 1300, 1301, Fate::accepted);
  const Recorded part = read_part(incident, {1200, shm::kForever});
  ASSERT_EQ(part.runs.size(), 1u);
  EXPECT_EQ(part.runs[0].start, 1200);
  EXPECT_EQ(part.runs[0].decisions.size(), 1u);
  const auto& steps = part.runs[0].sources.at("/low").steps;
  ASSERT_EQ(steps.size(), 2u);
  EXPECT_EQ(steps[0].kind, evidence::Step::Kind::state);
  EXPECT_EQ(steps[0].word, shm::arrival(1109, 500));
}

TEST(PartOfARecording, IsATraceThatBeginsWithWhoWasActive) {
  Incident incident;
  incident.arrive("/low", 1010, 1011, Fate::accepted);
  incident.arrive("/high", 1600, 1601, Fate::accepted);
  incident.arrive("/low", 1900, 1901, Fate::discarded);
  incident.arrive("/high", 2400, 2401, Fate::accepted);
  evidence::Models models(compile_texts);
  std::ostringstream trace;
  evidence::write_trace(read_part(incident, {1800, 2400}), models, trace);
  EXPECT_EQ(trace.str(), "t_ns,source,event\n1600,/high,arrive\n1900,/low,arrive\n");
}

TEST(PartOfARecording, HasTheWinnersOfItsTime) {
  Incident incident;
  incident.arrive("/high", 1010, 1011, Fate::accepted);
  incident.arrive("/low", 1100, 1101, Fate::discarded);
  incident.arrive("/low", 1300, 1301, Fate::discarded);
  incident.arrive("/low", 2000, 2001, Fate::accepted);
  evidence::Models models(compile_texts);
  evidence::Judge reversed(compile_text(kReversed), true);
  const auto result = compare(read_part(incident, {1200, 1400}), models, reversed);
  EXPECT_EQ(result.decisions, 1u);
  EXPECT_EQ(result.changed.size(), 1u);
  ASSERT_EQ(result.intervals.size(), 1u);
  EXPECT_EQ(result.intervals[0].from, 1200);
  EXPECT_EQ(result.intervals[0].to, 1400);
  EXPECT_EQ(result.intervals[0].recorded, "/high");
  EXPECT_EQ(result.intervals[0].other, "/low");
}

// What it rests on was done later than what is kept.
TEST(PartOfARecording, DoesNotJudgeADecisionThatWasSeenMuchLater) {
  constexpr shm::Nanoseconds kMuchLater = 20'000'000'000;
  Incident incident;
  incident.arrive("/high", 15'000'000'000, 15'000'000'001, Fate::accepted);
  incident.arrive("/low", 1500, kMuchLater, Fate::discarded);
  EXPECT_EQ(counts_of(read_part(incident, {1200, 1600})), (Counts{0, 0, 0, 1, 0, 0}));
  EXPECT_EQ(counts_of(read_part(incident, {1200, shm::kForever})), (Counts{1, 1, 0, 0, 0, 0}));
}

constexpr shm::Nanoseconds kLongAfter = 60'000 * kMs;

Counts counts_at_1500(Incident& incident) { return counts_of(read_part(incident, {1500, 1600})); }

// A component that comes anew does not know when its predecessor's arrivals were.
TEST(PartOfARecording, DoesNotDoubtWhatCameBeforeAComponentCameAnew) {
  Incident incident;
  incident.arrive("/high", 1010, 1011, Fate::accepted);
  incident.arrive("/low", 1550, 1551, Fate::accepted);
  incident.arrive("/high", kLongAfter, kLongAfter + 1, Fate::accepted);
  incident.arrive("/low", kLongAfter + 2, kLongAfter + 3, Fate::discarded);
  incident.state("/high", 0, kLongAfter + 20, shm::arrival(kLongAfter, 500),
                 evidence::SourceState::Why::joined);
  EXPECT_EQ(counts_at_1500(incident), (Counts{1, 0, 0, 0, 0, 0}));
}

// What was not told until long after the part stays unknown in it.
TEST(PartOfARecording, DoesNotKnowWhatCouldNotBeTapped) {
  Incident incident;
  evidence::Missed refused;
  refused.source = "/high";
  refused.from = refused.to = 1010;
  refused.why = evidence::Missed::Why::refused;
  incident.add(refused);
  incident.arrive("/low", 1550, 1551, Fate::discarded);
  incident.state("/high", kLongAfter, kLongAfter + 20, shm::arrival(kLongAfter, 500),
                 evidence::SourceState::Why::joined);
  EXPECT_EQ(counts_at_1500(incident), (Counts{0, 0, 0, 1, 0, 0}));
}

// As what closes says, which is no news then.
TEST(PartOfARecording, KnowsSinceWhenASourceWasDeactivated) {
  constexpr shm::Nanoseconds kFrom = 30'000 * kMs;
  Incident incident;
  incident.deactivate("/high", 1010, 1011);
  incident.state("/low", 0, 1012, shm::kNeverActive);
  incident.arrive("/high", 1020, 1021, Fate::accepted);
  incident.deactivate("/high", 1030, 1031);
  incident.deactivate("/high", 1040, 1041);
  incident.arrive("/low", kFrom + 10, kFrom + 11, Fate::accepted);
  incident.state("/high", 1040, kFrom + 20, shm::deactivation(1030),
                 evidence::SourceState::Why::closed);
  EXPECT_EQ(counts_of(read_part(incident, {kFrom, kFrom + 100})), (Counts{1, 0, 0, 0, 0, 0}));
}

// Where nothing stands between the two.
TEST(PartOfARecording, KnowsWhoWasActiveBeforeWhatCameBehindIt) {
  constexpr shm::Nanoseconds kFrom = 30'000 * kMs;
  Incident incident(slowed(kOverride));
  incident.arrive("/high", 15'000 * kMs, 15'000 * kMs, Fate::accepted, kT);
  incident.arrive("/high", 2 * kLongAfter, 2 * kLongAfter, Fate::accepted, kT);
  evidence::Models models(compile_texts);
  std::ostringstream trace;
  evidence::write_trace(read_part(incident, {kFrom, kFrom + 100}), models, trace);
  EXPECT_EQ(trace.str(), "t_ns,source,event\n15000000000,/high,arrive\n");
}

// A file that was made to do harm would fill the memory with it.
TEST(PartOfARecording, DoesNotKeepLongTexts) {
  Incident incident;
  for (int i = 0; i < 3; ++i) {
    evidence::Arrival arrival;
    auto context = std::make_shared<evidence::SourceContext>();
    context->source = "/long";
    for (int port = 0; port < 64; ++port) {
      context->destinations.push_back("/" + std::string(100, 'p') + std::to_string(port));
    }
    arrival.context = std::move(context);
    arrival.time = arrival.seen = 1100 + i;
    arrival.masks.accepted = ~std::uint64_t{0};
    incident.add(arrival);
  }
  incident.arrive("/low", 1200, 1201, Fate::accepted);
  incident.arrive("/low", 1202, 1203, Fate::accepted);
  std::map<std::string, int> arrivals;
  const auto use = [&](evidence::Record&& record) {
    if (!std::holds_alternative<evidence::Arrival>(record)) return;
    ++arrivals[evidence::context_of(record)->source];
  };
  evidence::read_recording(incident.file(), evidence::Payloads::pass_over, use, {},
                           {kLongAfter, shm::kForever});
  EXPECT_EQ(arrivals, (std::map<std::string, int>{{"/long", 3}, {"/low", 1}}));
}

// Where states are many, as of a source that cannot be tapped, all others are passed over still.
TEST(PartOfARecording, ReadsOfOthersWhatStatesOfThemRestOn) {
  Incident incident;
  for (int i = 0; i < 50; ++i) {
    incident.arrive("/high", 1100 + 10 * i, 1101 + 10 * i, Fate::accepted);
    incident.state("/low", 0, 1105 + 10 * i, shm::arrival(1104 + 10 * i, 500));
  }
  int arrivals = 0;
  const auto use = [&](evidence::Record&& record) {
    arrivals += std::holds_alternative<evidence::Arrival>(record) ? 1 : 0;
  };
  evidence::read_recording(incident.file(), evidence::Payloads::pass_over, use, {},
                           {kLongAfter, shm::kForever});
  EXPECT_EQ(arrivals, 1);
}

// Who replays it waits for nothing of what stands behind it.
TEST(PartOfARecording, IsHandedOnBeforeWhatIsBehindItHasBeenRead) {
  Incident incident;
  incident.arrive("/low", 1550, 1551, Fate::accepted);
  for (int i = 0; i < 20'000; ++i) {
    incident.arrive("/low", kLongAfter + i, kLongAfter + i + 1, Fate::accepted);
  }
  std::uint64_t at = 0;
  std::uint64_t handed_on_at = 0;
  const auto use = [&](evidence::Record&& record) {
    const auto* arrival = std::get_if<evidence::Arrival>(&record);
    if (arrival != nullptr && arrival->time == 1550) handed_on_at = at;
  };
  evidence::read_recording(incident.file(), evidence::Payloads::read, use,
                           [&](std::uint64_t done, std::uint64_t /*all*/) { at = done; },
                           {1500, 1600});
  EXPECT_GT(handed_on_at, 0u);
  EXPECT_LT(handed_on_at, at / 2);
}

TEST(PartOfARecording, LeavesOutRunsThatLieOutside) {
  Incident incident;
  incident.arrive("/low", 1010, 1011, Fate::accepted);
  incident.add(evidence::Start{2000, "test", {}, "none"});
  incident.put_in_force(kOverride, 1, 1990);
  incident.arrive("/low", 2010, 2011, Fate::accepted);
  EXPECT_EQ(read_part(incident, {0, 2000}).runs.size(), 1u);
  EXPECT_EQ(read_part(incident, {2000, shm::kForever}).runs.size(), 1u);
  EXPECT_EQ(read_part(incident, {1005, 2005}).runs.size(), 2u);
  EXPECT_TRUE(read_part(incident, {1500, 1600}).runs.empty()) << "nothing was recorded then";
}

// What is missing before and behind it does not make the part doubtful.
TEST(PartOfARecording, TellsOfWhatIsMissingInIt) {
  Incident incident;
  for (const shm::Nanoseconds each : {1100, 1500, 1900}) {
    evidence::Missed missed;
    missed.source = "/low";
    missed.from = each;
    missed.to = each + 20;
    missed.events = 3;
    missed.samples = 2;
    incident.add(missed);
    incident.state("/low", each + 10, each + 20, shm::arrival(each + 10, 500),
                   evidence::SourceState::Why::gap, 3);
  }
  const Recorded part = read_part(incident, {1400, 1600});
  ASSERT_EQ(part.runs.size(), 1u);
  EXPECT_EQ(part.runs[0].lost, 3u);
  EXPECT_EQ(part.runs[0].lost_samples, 2u);
  ASSERT_EQ(part.runs[0].gaps.size(), 1u);
  EXPECT_EQ(part.runs[0].gaps[0].from, 1500);
}

}  // namespace
}  // namespace arbiter::test
