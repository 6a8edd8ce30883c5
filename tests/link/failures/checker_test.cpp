// The checker sees what it is there for: recordings that are made up, each with one thing wrong.
#include "tests/link/failures/checker.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/evidence/incident.hpp"

namespace arbiter::failures {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Kind = Happened::Kind;

constexpr const char* kSource = "/Host1/cmd:o";
constexpr const char* kLower = "/Hold2/cmd:o";

MostAge always(Nanoseconds most) {
  return [most](Nanoseconds) { return most * kMs; };
}

// The source of host1, as host2 has recorded it; times are in milliseconds.
class Recorded {
 public:
  Recorded() { importer.name = "host2"; }

  Recorded& arrives(std::uint64_t number, Nanoseconds at, Nanoseconds made,
                    std::uint32_t life = 1) {
    Happened event;
    event.time = at * kMs;
    event.seen = event.time;
    event.command = Command{1, life, number, made * kMs};
    event.exporter = 70 + life;
    event.sequence = number;
    importer.sources[kSource].push_back(event);
    return *this;
  }
  Recorded& published(std::uint64_t number, Nanoseconds at) {
    Happened event;
    event.time = event.seen = at * kMs;
    event.command = Command{1, 1, number, at * kMs};
    event.sequence = number;
    exporter.sources[kSource].push_back(event);
    return *this;
  }
  Recorded& deactivated(Nanoseconds at) {
    Happened event;
    event.kind = Kind::deactivation;
    event.time = event.seen = at * kMs;
    exporter.sources[kSource].push_back(event);
    return *this;
  }
  Recorded& happens(Kind kind, Nanoseconds at, const char* source = kSource, bool won = false) {
    Happened event;
    event.kind = kind;
    event.time = event.seen = at * kMs;
    event.won = won;
    importer.sources[source].push_back(event);
    return *this;
  }

  // Its sample stays at home.
  Recorded& signals(std::uint64_t number, Nanoseconds at) {
    Happened event;
    event.kind = Kind::signal;
    event.time = event.seen = at * kMs;
    event.exporter = 71;
    event.sequence = number;
    importer.sources[kSource].push_back(event);
    return *this;
  }

  [[nodiscard]] Findings age(Nanoseconds most) const {
    Findings found;
    Checked checked;
    check_age(importer, exporter, kSource, always(most), found, checked);
    return found;
  }
  [[nodiscard]] Findings order() const {
    Findings found;
    check_order(importer, kSource, found);
    return found;
  }
  [[nodiscard]] Findings ends() const {
    Findings found;
    Checked checked;
    check_ends(importer, exporter, kSource, found, checked);
    return found;
  }
  [[nodiscard]] Findings losses(std::uint64_t counted, const std::vector<Span>& spans = {}) const {
    Findings found;
    Checked checked;
    check_losses(importer, kSource, counted, spans, found, checked);
    return found;
  }
  [[nodiscard]] Findings winners(Nanoseconds timeout = 100) const {
    Findings found;
    Checked checked;
    check_winners(importer, "", {{kSource, {0, timeout * kMs}}, {kLower, {1, 100 * kMs}}}, found,
                  checked);
    return found;
  }

  HostEvidence importer;
  HostEvidence exporter;
};

TEST(Checker, SeesASampleThatIsTooOld) {
  EXPECT_THAT(Recorded().published(1, 10).arrives(1, 110, 10).age(100), IsEmpty());
  EXPECT_THAT(Recorded().published(1, 10).arrives(1, 111, 10).age(100),
              ElementsAre(HasSubstr("arrived when it was 101.000 ms old")));
}

// A publisher that is held up before publish() makes it late, not the network.
TEST(Checker, TakesTheTimeOfPublishingFromTheExporter) {
  EXPECT_THAT(Recorded().published(1, 50).arrives(1, 120, 10).age(100), IsEmpty());
  Findings found;
  Checked checked;
  const Recorded unknown = Recorded().arrives(1, 120, 10);
  check_age(unknown.importer, unknown.exporter, kSource, always(100), found, checked);
  EXPECT_THAT(found, IsEmpty());
  EXPECT_EQ(checked.unsure, 1U);
}

TEST(Checker, SeesDoublesAndWhatIsOutOfOrder) {
  EXPECT_THAT(Recorded().arrives(1, 10, 9).arrives(3, 20, 19).order(), IsEmpty());
  EXPECT_THAT(Recorded().arrives(1, 10, 9).arrives(1, 20, 9).order(),
              testing::Contains(HasSubstr("1.1 arrived after 1.1")));
  EXPECT_THAT(Recorded().arrives(2, 10, 9).arrives(1, 20, 8).arrives(3, 30, 29).order(),
              testing::Contains(HasSubstr("1.1 arrived after 1.2")));
}

TEST(Checker, SeesWhatAnEarlierLifeSays) {
  EXPECT_THAT(Recorded().arrives(9, 10, 9).arrives(1, 20, 19, 2).order(), IsEmpty());
  EXPECT_THAT(Recorded().arrives(1, 10, 9, 2).arrives(9, 20, 5, 1).order(),
              ElementsAre(HasSubstr("1.9 arrived after 2.1")));
}

TEST(Checker, KnowsWhatStaysAtHome) {
  EXPECT_THAT(Recorded().signals(1, 10).arrives(1, 11, 9).signals(2, 20).order(), IsEmpty());
  EXPECT_THAT(Recorded().signals(1, 10).signals(1, 11).order(),
              ElementsAre(HasSubstr("number 1 arrived after number 1")));
  EXPECT_THAT(Recorded().published(1, 10).signals(1, 111).age(100),
              ElementsAre(HasSubstr("number 1 arrived when it was 101.000 ms old")));
  EXPECT_THAT(Recorded().signals(1, 10).signals(4, 20).losses(1),
              ElementsAre(HasSubstr("2 samples are missing, but only 1")));
}

TEST(Checker, NamesWhatTheRecorderDidNotTake) {
  Recorded home = Recorded().published(1, 10).published(2, 20).published(1, 60).signals(1, 11);
  for (Happened& event : home.exporter.sources[kSource]) event.command.reset();
  home.exporter.lives = {5 * kMs, 50 * kMs};
  name_own(home.exporter, kSource, 1);
  const auto& own = home.exporter.sources[kSource];
  EXPECT_EQ(own[1].command->life, 1U);
  EXPECT_EQ(own[1].command->number, 2U);
  EXPECT_EQ(own[2].command->life, 2U);
  home.signals(1, 70).signals(1, 5000).signals(2, 5010);
  name_imported(home.importer, home.exporter, kSource);
  const auto& imported = home.importer.sources[kSource];
  EXPECT_EQ(imported[0].command->made, 10 * kMs);
  EXPECT_FALSE(imported[1].command) << "it may be that of either life";
  EXPECT_EQ(imported[2].command->life, 2U);
  EXPECT_FALSE(imported[3].command) << "the later life may have published it, too";
  EXPECT_THAT(home.order(), testing::Not(IsEmpty())) << "it arrived before";
}

// What a life publishes before the recorder has joined its port is in no recording.
TEST(Checker, DoesNotTakeANewLifesNumbersForThoseOfTheOldOne) {
  Recorded home = Recorded().published(1, 10).published(2, 20).signals(1, 5000);
  home.exporter.lives = {5 * kMs};
  EXPECT_THAT(home.age(100), testing::SizeIs(1));
  home.exporter.lives.push_back(4990 * kMs);
  EXPECT_THAT(home.age(100), IsEmpty());
}

TEST(Checker, KnowsWhatWasAskedFor) {
  Recorded wins = Recorded().published(1, 10).published(2, 20).published(3, 30);
  wins.signals(1, 11).signals(2, 21).arrives(2, 21, 20).signals(3, 31).arrives(4, 41, 40);
  for (Happened& event : wins.importer.sources[kSource]) event.won = event.sequence > 1;
  name_imported(wins.importer, wins.exporter, kSource);
  EXPECT_THAT(wins.order(), IsEmpty());
  const auto asked = asked_for(wins.importer, kSource);
  ASSERT_THAT(asked, testing::SizeIs(2));
  EXPECT_TRUE(asked[0].is_completed);
  EXPECT_FALSE(asked[1].is_completed);
}

TEST(Checker, SeesADeactivationInTheWrongPlace) {
  const auto ended = [](Nanoseconds at_exporter) {
    Recorded one = Recorded().published(1, 10).published(2, 30).deactivated(at_exporter);
    return one.arrives(1, 11, 10).happens(Kind::deactivation, 21).arrives(2, 31, 30).ends();
  };
  EXPECT_THAT(ended(20), IsEmpty());
  EXPECT_THAT(ended(40), ElementsAre(HasSubstr("between 1.1 and 1.2, but not so at its exporter")));
  EXPECT_THAT(ended(5), testing::SizeIs(1));
}

// What a recorder finds when it joins may be of any time.
TEST(Checker, FindsADeactivationBesideWhatWasThereBefore) {
  Recorded one = Recorded().published(1, 10).published(2, 30).deactivated(20).deactivated(0);
  one.exporter.sources[kSource].back().is_state = true;
  one.arrives(1, 11, 10).happens(Kind::deactivation, 21).arrives(2, 31, 30);
  EXPECT_THAT(one.ends(), IsEmpty());
}

TEST(Checker, MeasuresWhenADeactivationComes) {
  const Recorded one =
      Recorded().published(1, 10).deactivated(20).published(2, 900).happens(Kind::deactivation, 23);
  const auto ends = ends_of(one.exporter, kSource);
  ASSERT_THAT(ends, testing::SizeIs(1));
  EXPECT_EQ(ends[0].until, 900 * kMs);
  EXPECT_EQ(first_end_after(one.importer, kSource, ends[0].when, false).took, 3 * kMs);
  const Recorded newer = Recorded().arrives(1, 25, 22);
  EXPECT_TRUE(first_end_after(newer.importer, kSource, 20 * kMs, true).is_there);
  EXPECT_FALSE(first_end_after(newer.importer, kSource, 20 * kMs, false).is_there);
  EXPECT_FALSE(first_end_after(newer.importer, kSource, 23 * kMs, true).is_there);
  Recorded unknown = Recorded().deactivated(20).published(2, 900);
  std::vector<Happened>& events = unknown.exporter.sources[kSource];
  events.insert(events.end() - 1, Happened{Kind::gap, 20 * kMs, 30 * kMs});
  EXPECT_THAT(ends_of(unknown.exporter, kSource), IsEmpty()) << "what followed is not known";
  Recorded again = Recorded().deactivated(20).deactivated(5).published(2, 900);
  again.exporter.sources[kSource][1].is_state = true;
  ASSERT_THAT(ends_of(again.exporter, kSource), testing::SizeIs(1));
  EXPECT_EQ(ends_of(again.exporter, kSource)[0].until, 900 * kMs) << "nothing has happened there";
  const Recorded late = Recorded().arrives(1, 25, 22).happens(Kind::deactivation, 40);
  EXPECT_FALSE(first_end_after(late.importer, kSource, 20 * kMs, false).is_there)
      << "another one, behind what follows";
}

TEST(Checker, SeesLossesThatNobodyCounted) {
  const Recorded gap = Recorded().arrives(1, 10, 9).arrives(4, 20, 19).arrives(6, 30, 29);
  EXPECT_THAT(gap.losses(3), IsEmpty());
  EXPECT_THAT(gap.losses(2), ElementsAre(HasSubstr("3 samples are missing, but only 2")));
}

TEST(Checker, SeesLossesThatAreCountedThoughNothingWasLost) {
  const Recorded one = Recorded().published(1, 10).published(2, 20).arrives(2, 22, 20);
  Findings found;
  check_counts(one.importer, one.exporter, kSource, 1, 0, 0, found);
  EXPECT_THAT(found, IsEmpty());
  check_counts(one.importer, one.exporter, kSource, 2, 1, 0, found);
  EXPECT_THAT(found, IsEmpty()) << "the state that its exporter said";
  check_counts(one.importer, one.exporter, kSource, 2, 0, 0, found);
  EXPECT_THAT(found, ElementsAre(HasSubstr("1 arrived, but 2 are counted as missing")));
}

TEST(Checker, KnowsWhichModelWasInForce) {
  Recorded one = Recorded().happens(Kind::signal, 10).happens(Kind::sample, 50, kLower, true);
  one.importer.models = {{5 * kMs, 1, "default", "start"}, {40 * kMs, 2, "other", "switch"}};
  const std::map<std::string, Ranked> ranks{{kSource, {0, 100 * kMs}}, {kLower, {1, 100 * kMs}}};
  Findings found;
  Checked checked;
  check_winners(one.importer, "default", ranks, found, checked);
  EXPECT_THAT(found, IsEmpty());
  check_winners(one.importer, "other", ranks, found, checked);
  EXPECT_THAT(found, testing::SizeIs(1));
}

TEST(Checker, DoesNotTakeOneModelForAnotherThatTheRecordingDoesNotHave) {
  HostEvidence host;
  host.models = {{5 * kMs, 1, "default", "start"}, {40 * kMs, 3, "other", "switch"}};
  EXPECT_FALSE(had_model(host, "default", 30 * kMs, 35 * kMs)) << "model 2 may have come before";
  EXPECT_TRUE(had_model(host, "other", 50 * kMs, 51 * kMs));
  host.models[1].generation = 2;
  EXPECT_TRUE(had_model(host, "default", 30 * kMs, 35 * kMs));
  EXPECT_FALSE(had_model(host, "default", 39 * kMs, 40 * kMs));
  EXPECT_FALSE(had_model(host, "default", 4 * kMs, 4 * kMs));
}

TEST(Checker, DoesNotMissWhatNobodyWasThereToCount) {
  const Recorded gap = Recorded().arrives(1, 10, 9).arrives(4, 20, 19).arrives(6, 30, 29);
  EXPECT_THAT(gap.losses(1, {{15 * kMs, 16 * kMs}}), IsEmpty());
  EXPECT_THAT(gap.losses(0, {{15 * kMs, 16 * kMs}}), testing::SizeIs(1));
  EXPECT_THAT(Recorded().arrives(5, 10, 9).arrives(9, 20, 19, 2).losses(0), IsEmpty());
  EXPECT_THAT(Recorded().arrives(1, 10, 9).happens(Kind::gap, 15).arrives(4, 20, 19).losses(0),
              IsEmpty());
}

TEST(Checker, SeesTwoWinners) {
  const auto commands_at = [](Nanoseconds at) {
    return Recorded().happens(Kind::signal, 10).happens(Kind::sample, at, kLower, true).winners();
  };
  EXPECT_THAT(commands_at(9), IsEmpty());
  EXPECT_THAT(commands_at(11), ElementsAre(HasSubstr("/Hold2/cmd:o commands at 11.000 ms")));
  EXPECT_THAT(commands_at(110), testing::SizeIs(1));
  EXPECT_THAT(commands_at(111), IsEmpty());
}

TEST(Checker, KnowsWhatEndsAnActivity) {
  Recorded ended = Recorded().happens(Kind::signal, 10).happens(Kind::deactivation, 20);
  EXPECT_THAT(ended.happens(Kind::sample, 21, kLower, true).winners(), IsEmpty());
  Recorded forgotten = Recorded().happens(Kind::signal, 10).happens(Kind::sample, 21, kLower, true);
  forgotten.importer.beginnings = {0, 20 * kMs};
  EXPECT_THAT(forgotten.winners(), IsEmpty());
  forgotten.importer.beginnings = {0, 22 * kMs};
  EXPECT_THAT(forgotten.winners(), testing::SizeIs(1));
}

TEST(Checker, SeesWhatComesThroughACut) {
  const auto through = [](Nanoseconds made, Nanoseconds at) {
    Findings found;
    check_cuts(Recorded().arrives(1, at, made).importer, kSource, {{100 * kMs, 200 * kMs}}, found);
    return found;
  };
  EXPECT_THAT(through(99, 101), IsEmpty());
  EXPECT_THAT(through(101, 200), IsEmpty());
  EXPECT_THAT(through(101, 199), testing::SizeIs(1));
}

// By the product's own rules, over a recording in a file.
TEST(Checker, SeesADecisionThatTheModelForbids) {
  using Fate = test::Incident::Fate;
  test::Incident incident;
  incident.arrive("/high", 1010, 1011, Fate::accepted);
  incident.arrive("/low", 1020, 1021, Fate::accepted);
  const HostEvidence evidence = read_evidence("host2", "/p", incident.file());
  Findings found;
  Checked checked;
  check_decisions(evidence, found, checked);
  EXPECT_THAT(found, ElementsAre(HasSubstr("1 decisions that its model does not permit")));
  EXPECT_EQ(checked.decisions, 2U);
  check_winners(evidence, "", {{"/high", {0, 500}}, {"/low", {1, 500}}}, found, checked);
  EXPECT_THAT(found, testing::SizeIs(2));
}

TEST(Checker, MeasuresWhenTheLastInCommandCommands) {
  const std::map<std::string, Ranked> ranks{{kSource, {0, 100 * kMs}}, {kLower, {1, 100 * kMs}}};
  Recorded fell = Recorded()
                      .happens(Kind::sample, 10, kSource, true)
                      .happens(Kind::sample, 50, kLower)
                      .happens(Kind::sample, 113, kLower, true)
                      .happens(Kind::sample, 400, kSource, true);
  const auto once = fallbacks(fell.importer, ranks, kLower, 100 * kMs);
  ASSERT_THAT(once, testing::SizeIs(1));
  EXPECT_EQ(once[0].since, 110 * kMs);
  EXPECT_EQ(once[0].next.took, 3 * kMs);
  // Nothing commands before the next one comes.
  const Recorded silent = Recorded().happens(Kind::sample, 10).happens(Kind::sample, 400);
  const auto never = fallbacks(silent.importer, ranks, kLower, 100 * kMs);
  ASSERT_THAT(never, testing::SizeIs(1));
  EXPECT_FALSE(never[0].next.is_there);
  EXPECT_THAT(fallbacks(silent.importer, ranks, kLower, 300 * kMs), IsEmpty());
  EXPECT_EQ(first_arrival_after(fell.importer, kLower, 100 * kMs).took, 13 * kMs);
}

TEST(Checker, DoesNotCountTheSilenceBeforeWhatArrivesFirst) {
  const auto took = [](const Recorded& recorded) {
    const Recovery recovery =
        recovery_after(recorded.importer, recorded.exporter, kSource, 100 * kMs);
    EXPECT_TRUE(recovery.is_there);
    return recovery.took / kMs;
  };
  // Heard late, though something was published all the time.
  Recorded late = Recorded().published(1, 90);
  for (std::uint64_t number = 2; number <= 30; ++number) {
    late.published(number, 100 + static_cast<Nanoseconds>(number) * 50);
  }
  EXPECT_EQ(took(late.arrives(28, 1503, 1500)), 1303);
  // Two were not heard, and nothing followed them for long.
  Recorded silent = Recorded().published(1, 110).published(2, 150).published(3, 1500);
  EXPECT_EQ(took(silent.arrives(3, 1503, 1500)), 43);
  // Nothing was published before.
  EXPECT_EQ(took(Recorded().published(1, 90).published(2, 1500).arrives(2, 1503, 1500)), 3);
  // A signal is as old as the event of its number.
  Recorded signal = Recorded().published(1, 110);
  EXPECT_EQ(took(signal.signals(1, 3000)), 2890);
  const Recorded never = Recorded().arrives(1, 92, 90);
  EXPECT_FALSE(recovery_after(never.importer, never.exporter, kSource, 100 * kMs).is_there);
}

TEST(Checker, FindsNothingWhereNothingIsWrong) {
  const Recorded good =
      Recorded().published(1, 10).published(2, 20).arrives(1, 12, 10).arrives(2, 22, 20).happens(
          Kind::deactivation, 30);
  EXPECT_THAT(good.age(100), IsEmpty());
  EXPECT_THAT(good.order(), IsEmpty());
  EXPECT_THAT(good.losses(0), IsEmpty());
  EXPECT_THAT(good.winners(), IsEmpty());
}

}  // namespace
}  // namespace arbiter::failures
