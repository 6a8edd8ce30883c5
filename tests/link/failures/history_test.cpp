// What the checker makes of recordings by what befell the hosts: who speaks, and who switches.
#include "tests/link/failures/history.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/link/failures/speakers.hpp"
#include "tests/link/failures/switches.hpp"

namespace arbiter::failures {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Hosts 1 and 2 have the shared source open from the beginning; host 3 hears one of them.
class Shared {
 public:
  Shared() {
    host.name = "host3";
    history.hosts.resize(3);
    history.hosts[0].rivals = {{1, {1, 0}, false}};
    history.hosts[1].rivals = {{1, {1, 0}, false}};
  }
  Shared& hears(unsigned from, std::uint64_t number, Nanoseconds at) {
    Happened event;
    event.time = event.seen = at * kSecond;
    event.exporter = from == 3 ? 0 : from;
    event.sequence = number;
    event.command = Command{from, 1, number, at * kSecond};
    host.sources[kShared].push_back(event);
    return *this;
  }
  [[nodiscard]] Findings found() const {
    Findings findings;
    Checked checked;
    check_speakers(host, 3, history, findings, checked);
    return findings;
  }

  HostEvidence host;
  History history;
};

// As if nobody ever waited for a processor.
void look(Waits& waits, Nanoseconds from, Nanoseconds to) {
  for (unsigned host = 0; host <= 3; ++host) {
    waits.note(host, from, 0);
    waits.note(host, to, 0);
  }
}

TEST(Speakers, AreKeptUntilTheyAreGone) {
  Shared kept;
  look(kept.history.waits, 0, 100 * kSecond);
  kept.hears(1, 1, 10).hears(1, 2, 11);
  EXPECT_THAT(kept.found(), IsEmpty());
  kept.hears(2, 1, 12);
  EXPECT_THAT(kept.found(), ElementsAre(HasSubstr("the speaker had not gone")));
  Shared gone = kept;
  gone.history.hosts[0].rivals[0].span.to = 11 * kSecond + kMs;
  EXPECT_THAT(gone.found(), IsEmpty());
  Shared cut = kept;
  cut.history.troubled = {{1, Trouble::cut, {10 * kSecond, 11 * kSecond}}};
  EXPECT_THAT(cut.found(), IsEmpty());
  Shared starved;
  starved.hears(1, 1, 11).hears(2, 1, 12);
  look(starved.history.waits, 0, 8 * kSecond);
  for (unsigned host = 0; host <= 3; ++host)
    starved.history.waits.note(host, 13 * kSecond, 2 * kSecond);
  EXPECT_THAT(starved.found(), IsEmpty());
}

TEST(Speakers, OfThisHostComeFirst) {
  Shared own;
  look(own.history.waits, 0, 100 * kSecond);
  own.hears(3, 1, 10).hears(1, 1, 11);
  EXPECT_THAT(own.found(), IsEmpty()) << "its own may have ended";
  own.hears(3, 2, 12);
  EXPECT_THAT(own.found(), ElementsAre(HasSubstr("its own component had the source open")));
}

TEST(Speakers, DoNotComeBackToTheirHost) {
  Shared back;
  back.hears(3, 1, 10);
  back.host.sources[kShared].back().exporter = 77;
  EXPECT_THAT(back.found(), ElementsAre(HasSubstr("an import came back")));
}

TEST(Speakers, AreFollowedByThoseThatAreLeft) {
  Shared left;
  left.history.hosts[0].rivals[0].span.to = 10 * kSecond;
  left.hears(1, 1, 10).hears(2, 1, 12);
  const auto all = successions(left.host, 3, left.history);
  ASSERT_THAT(all, testing::SizeIs(1));
  EXPECT_EQ(all[0].to, 2U);
  EXPECT_EQ(all[0].recovery.took, 2 * kSecond);
}

TEST(Speakers, AreFollowedWhereTheyAreNotHeardAnyMore) {
  Shared cut;
  cut.history.cuts[{1, 3}] = {{10 * kSecond, 20 * kSecond}};
  cut.history.troubled = {{1, Trouble::mute, {10 * kSecond, 20 * kSecond}}};
  cut.hears(1, 1, 10).hears(2, 1, 12);
  const auto all = successions(cut.host, 3, cut.history);
  ASSERT_THAT(all, testing::SizeIs(1));
  EXPECT_EQ(all[0].recovery.took, 2 * kSecond);
  cut.history.cuts[{1, 3}][0].to = 12 * kSecond;
  EXPECT_THAT(successions(cut.host, 3, cut.history), IsEmpty()) << "it may not have been gone";
}

TEST(Troubles, CountForThoseWhomTheyBefall) {
  History history;
  history.troubled = {{1, Trouble::cut, {1, 9}},
                      {2, Trouble::rival, {1, 9}},
                      {0, Trouble::split, {1, 9}},
                      {3, Trouble::cut, {1, 9}}};
  EXPECT_EQ(history.troubles_of(1, 2, 5), 2U);
  EXPECT_EQ(history.troubles_of(1, 2, 9), 0U);
}

class Switched {
 public:
  Switched() {
    for (const char* const name : {"host1", "host2"}) {
      hosts.emplace_back();
      hosts.back().name = name;
      hosts.back().models = {{1, 1, "default", "start"}};
    }
    history.hosts.resize(2);
  }
  Switched& is_in_force(unsigned number, std::uint64_t generation, Nanoseconds at) {
    hosts[number - 1].models.push_back({at * kMs, generation, "other", "switch"});
    return *this;
  }
  // At host 1, from 100 to 200 ms, to "other".
  Switched& was_told(bool is_committed, const std::string& first, const std::string& second) {
    SwitchTried tried;
    tried.host = 1;
    tried.model = 1;
    tried.span = {100 * kMs, 200 * kMs};
    const auto of = [](const char* host, const std::string& outcome) {
      const std::string generation = outcome == "switched" ? "2" : "0";
      return std::string(R"({"host":")") + host + R"(","outcome":")" + outcome +
             R"(","prepared":true,"generation":)" + generation + "}";
    };
    tried.report = std::string(R"({"committed":)") + (is_committed ? "true" : "false") +
                   R"(,"hosts":[)" + of("host1", first) + "," + of("host2", second) + "]}";
    history.switches.push_back(tried);
    return *this;
  }
  [[nodiscard]] Findings found() const {
    Findings findings;
    Checked checked;
    check_switches(hosts, history, findings, checked);
    return findings;
  }

  std::vector<HostEvidence> hosts;
  History history;
};

TEST(Switches, AreWhatTheOperatorWasTold) {
  Switched both = Switched().is_in_force(1, 2, 150).is_in_force(2, 2, 160);
  EXPECT_THAT(both.was_told(true, "switched", "switched").found(), IsEmpty());
  EXPECT_THAT(Switched().is_in_force(1, 2, 150).was_told(true, "switched", "switched").found(),
              ElementsAre(HasSubstr("host2 was reported to have model 2")));
}

TEST(Switches, HappenToNobodyWhoWasNotTold) {
  EXPECT_THAT(Switched().is_in_force(2, 2, 160).found(),
              ElementsAre(HasSubstr("though no operator was told")));
  const std::string no = "not switched";
  EXPECT_THAT(Switched().is_in_force(2, 2, 160).was_told(false, no, no).found(),
              ElementsAre(HasSubstr("though no operator was told")));
  EXPECT_THAT(Switched().is_in_force(2, 2, 90).was_told(true, no, "switched").found(),
              testing::Contains(HasSubstr("though no operator was told")));
}

TEST(Switches, OfWhichNothingIsKnownMayHaveHappened) {
  const auto unknown = [] { return Switched().was_told(true, "not switched", "unknown"); };
  EXPECT_THAT(unknown().found(), IsEmpty());
  EXPECT_THAT(unknown().is_in_force(2, 2, 1000).found(), IsEmpty());
  EXPECT_THAT(unknown().is_in_force(2, 2, 10'000).found(), testing::SizeIs(1));
}

TEST(Waits, AreCountedAroundATime) {
  Waits waits;
  waits.note(1, 100 * kMs, 5 * kMs);
  waits.note(1, 200 * kMs, 7 * kMs);
  waits.note(1, 300 * kMs, 17 * kMs);
  EXPECT_EQ(waits.waited(1, 110 * kMs, 190 * kMs), 2 * kMs);
  EXPECT_EQ(waits.waited(1, 150 * kMs, 250 * kMs), 12 * kMs);
  EXPECT_EQ(waits.waited(1, 50 * kMs, 250 * kMs), Waits::kNever);
  EXPECT_EQ(waits.waited(2, 110 * kMs, 190 * kMs), Waits::kNever);
}

TEST(Counts, AreReadFromTheStatus) {
  EXPECT_EQ(counted_in("host head, 3 lost, 2 late, 7 withheld"), 5U);
  EXPECT_EQ(counted_in("host head"), 0U);
  EXPECT_EQ(withheld_in("host head, 7 withheld, 2 withheld though they were wanted"), 7U);
  EXPECT_EQ(withheld_in("host head, 2 withheld though they were wanted"), 0U);
}

}  // namespace
}  // namespace arbiter::failures
