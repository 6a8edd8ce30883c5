// --from and --to: a part of a recording, by the time of day.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/evidence/incident.hpp"
#include "tests/recorder/in_zone.hpp"
#include "tests/recorder/recording.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr shm::Nanoseconds kInSecond = 1'000'000'000;
// So far is the wall clock ahead of a recording's times.
constexpr shm::Nanoseconds kAhead = 5'000'000;

std::string lasting(const std::string& model) {
  std::string text = model;
  return text.replace(text.find("500ns"), 5, "2s");
}

// From 00:00:00.005 on, for a minute. /high commands from 20 s to 30 s.
class PartOfTheTools : public testing::Test {
 protected:
  PartOfTheTools() : incident_(lasting(kOverride)) {
    using Why = evidence::WinnerChange::Why;
    const auto win = [&](const char* winner, const char* before, int second, Why why,
                         const char* by) {
      incident_.add(evidence::WinnerChange{"/p", winner, before, at(second), why, by, 1});
    };
    win("/low", "", 1, Why::arrival, "/low");
    for (int second = 1; second < 60; ++second) {
      const bool is_inhibited = second >= 20 && second < 30;
      if (is_inhibited) arrive("/high", second, Incident::Fate::accepted);
      if (second == 20) win("/high", "/low", 20, Why::arrival, "/high");
      if (second == 30) {
        incident_.deactivate("/high", at(30) - 1, at(30));
        win("/low", "/high", 30, Why::deactivation, "/high");
      }
      arrive("/low", second, is_inhibited ? Incident::Fate::discarded : Incident::Fate::accepted);
    }
    file_ = incident_.file(60 * kInSecond);
  }

  [[nodiscard]] ProgramResult tool(std::vector<std::string> arguments,
                                   const std::vector<std::string>& part,
                                   const std::string& zone = "UTC") const {
    arguments.insert(arguments.end(), part.begin(), part.end());
    return arbiter_in(zone, std::move(arguments));
  }
  [[nodiscard]] ProgramResult simulated(const std::vector<std::string>& part) const {
    return tool({"simulate", "--recording", file_}, part);
  }
  [[nodiscard]] ProgramResult winners(const std::vector<std::string>& part) const {
    return tool({"recording", "winners", file_}, part);
  }

  TemporaryDirectory directory_;
  std::string file_;

 private:
  static shm::Nanoseconds at(int second) { return second * kInSecond - kAhead; }
  void arrive(const char* source, int second, Incident::Fate fate) {
    const shm::Nanoseconds time = at(second) + (source == std::string("/low") ? 10 : 0);
    incident_.arrive(source, time, time + 1, fate, 2 * kInSecond);
    incident_.put_payload(8);
  }

  Incident incident_;
};

TEST_F(PartOfTheTools, IsDecidedAgain) {
  EXPECT_THAT(simulated({}).out, HasSubstr("\n69 decisions: 69 equal,"));
  const auto part = simulated({"--from", "00:00:25", "--to", "00:00:35"});
  EXPECT_EQ(part.exit_code, 0) << part.err;
  EXPECT_THAT(part.out, AllOf(HasSubstr("from 1970-01-01 00:00:25 UTC, 10.000 s: 2 sources, 15 "
                                        "arrivals\n"),
                              HasSubstr("\n15 decisions: 15 equal,")));
  EXPECT_THAT(simulated({"--from", "00:00:50"}).out, HasSubstr("\n10 decisions: 10 equal,"));
  EXPECT_THAT(simulated({"--to", "00:00:10"}).out, HasSubstr("\n9 decisions: 9 equal,"));
}

TEST_F(PartOfTheTools, IsDecidedByAnotherModel) {
  const std::string other = directory_.write("other.xml", lasting(kReversed));
  const auto part =
      tool({"simulate", other, "--recording", file_}, {"--from", "00:00:28", "--to", "00:00:31"});
  EXPECT_THAT(part.out, AllOf(HasSubstr("\n5 decisions: 1 the same, 4 changed, 0 uncertain\n"),
                              HasSubstr("  /p: /low instead of /high\n")));
}

TEST_F(PartOfTheTools, IsExplained) {
  const auto part = tool({"simulate", "--recording", file_, "--why=/p"},
                         {"--from", "00:00:25.5", "--to", "00:00:31"});
  EXPECT_EQ(part.exit_code, 0) << part.err;
  EXPECT_THAT(part.out, AllOf(testing::StartsWith("1970-01-01 00:00:25.500 "),
                              HasSubstr("  /p  /high wins as this begins\n"),
                              HasSubstr("  /p  /high -> /low  because /high was deactivated"),
                              Not(HasSubstr("00:00:31")), Not(HasSubstr("-> idle"))));
}

TEST_F(PartOfTheTools, IsExported) {
  const std::string trace = directory_.file("trace.csv");
  const std::string csv = directory_.file("decisions.csv");
  const auto exported = tool({"recording", "export", file_, "--trace", trace, "--csv", csv},
                             {"--from", "00:00:28.5", "--to", "00:00:30"});
  EXPECT_EQ(exported.exit_code, 0) << exported.err;
  EXPECT_EQ(content_of(trace),
            "t_ns,source,event\n27995000000,/high,arrive\n27995000010,/low,arrive\n"
            "28995000000,/high,arrive\n28995000010,/low,arrive\n29994999999,/high,deactivate\n");
  EXPECT_EQ(content_of(csv),
            "t_ns,source,destination,decision,winner\n28995000000,/high,/p,delivered,/high\n"
            "28995000010,/low,/p,discarded,/high\n");
}

// Who was active as it begins arrives first.
TEST_F(PartOfTheTools, IsReplayed) {
  Daemon daemon(kLasting);
  Node node("test");
  auto in = node.input_port("/p", {.depth = 16});
  const auto replayed =
      tool({"replay", file_, "--speed", "1000000", "--instance", daemon.instance()},
           {"--from", "00:00:28.5", "--to", "00:00:30"});
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
  EXPECT_THAT(replayed.out, HasSubstr("2 samples, 0 signals and 1 deactivation of 2 sources in "));
  EXPECT_THAT(replayed.out, HasSubstr("\nand first 2 signals, for who was active as it begins\n"));
  const auto taken = in.take();
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->source(), "/high");
  EXPECT_FALSE(in.take());
  EXPECT_THAT(tool({"replay", file_, "--as-fast-as-possible"}, {"--from", "00:00:50"}).out,
              HasSubstr("10 samples, 0 signals and 0 deactivations of 1 source in "));
}

// A source that the model of then does not name has its T.
TEST(ReplayOfAPart, KnowsTheTOfWhomTheModelDoesNotName) {
  Daemon daemon(kLasting);
  Incident incident(
      "<behaviors timeout='2s'><arbiter at='/p'><select from='/high'/></arbiter></behaviors>");
  incident.arrive("/low", 1'500'000'000, 1'500'000'001, Incident::Fate::none, 2'000'000'000);
  incident.put_payload(8);
  incident.arrive("/low", 3'000'000'000, 3'000'000'001, Incident::Fate::none, 2'000'000'000);
  incident.put_payload(8);
  const auto replayed = arbiter_in_utc(
      {"replay", incident.file(4'000'000'000), "--speed", "1000", "--from", "00:00:02"});
  EXPECT_THAT(replayed.out, HasSubstr("1 sample, 0 signals and 0 deactivations of 1 source in "));
  EXPECT_THAT(replayed.err, Not(HasSubstr("does not have the T")));
}

// /high arrived under a T of 10 s, and then T became 1 s: it kept /low out all the time.
TEST(ReplayOfAPart, GoesOnWithAnActivityThatIsLongerThanT) {
  const auto with = [](const std::string& timeout) {
    std::string model = kOverride;
    return model.replace(model.find("500ns"), 5, timeout);
  };
  constexpr shm::Nanoseconds kHalf = kInSecond / 2;
  Incident incident(with("10s"));
  incident.arrive("/high", 20 * kHalf, 20 * kHalf, Incident::Fate::accepted, 20 * kHalf);
  incident.put_in_force(with("1s"), 2, 22 * kHalf);
  for (int half = 24; half < 32; ++half) {
    incident.arrive("/low", half * kHalf, half * kHalf, Incident::Fate::discarded, 2 * kHalf);
    incident.put_payload(8);
  }
  Daemon daemon(with("1s"));
  Node node("test");
  auto in = node.input_port("/p", {.depth = 16});
  const auto replayed = arbiter_in_utc({"replay", incident.file(40 * kHalf), "--from", "00:00:12"});
  EXPECT_THAT(replayed.out, HasSubstr("8 samples, 0 signals and 0 deactivations of 2 sources in "));
  EXPECT_FALSE(in.take()) << replayed.err;
}

// Of those that are not in it, the nearest.
TEST_F(PartOfTheTools, BeginsAndEndsOnTheDaysThatFit) {
  EXPECT_THAT(simulated({"--from", "23:59:00", "--to", "00:00:10"}).out,
              HasSubstr("\n9 decisions: 9 equal,"));
  // There the day ends in the middle of the recording.
  const auto expect = [&](const std::vector<std::string>& part, const std::string& text) {
    const auto result = tool({"simulate", "--recording", file_}, part, "LATE-23:59:30");
    EXPECT_THAT(result.out + result.err, HasSubstr(text));
  };
  expect({"--from", "23:59:50", "--to", "00:00:10"}, "\n30 decisions: 30 equal,");
  expect({"--from", "23:59:50", "--to", "00:05:00"}, "\n50 decisions: 50 equal,");
  expect({"--from", "00:05:00"}, "--from: \"00:05:00\" is not in the recording");
  expect({"--from", "23:59:50", "--to", "23:59:40"}, "\"23:59:40\" is not after --from");
}

ProgramResult replayed_from_1_to_3(const std::string& file) {
  Daemon daemon(kLasting);
  return arbiter_in_utc({"replay", file, "--as-fast-as-possible", "--instance", daemon.instance(),
                         "--from", "00:00:01", "--to", "00:00:03"});
}

// Its publisher was stopped for long before it could tell of it.
TEST(ReplayOfAPart, HasWhatWasToldLate) {
  Incident incident;
  const shm::Nanoseconds told = 30 * kInSecond;
  incident.arrive("/low", 2 * kInSecond, 2 * kInSecond + 1, Incident::Fate::accepted);
  incident.put_payload(8);
  incident.state("/low", 2 * kInSecond, told, shm::arrival(2 * kInSecond, 500),
                 evidence::SourceState::Why::closed);
  incident.state("/low", told - 1, told, shm::arrival(told - 1, 500));
  incident.deactivate("/low", told, told + 1);
  incident.state("/high", told, told, shm::kNeverActive, evidence::SourceState::Why::joined);
  incident.arrive("/high", 2 * kInSecond + 10, told, Incident::Fate::discarded);
  incident.put_payload(8);
  EXPECT_THAT(replayed_from_1_to_3(incident.file()).out,
              HasSubstr("2 samples, 0 signals and 0 deactivations of 2 sources in "));
}

// With memory of its own, that did not know the source.
TEST(ReplayOfAPart, DoesNotBeginWithWhoWasActiveUnderADaemonBefore) {
  Incident incident;
  incident.arrive("/high", 2000, 2001, Incident::Fate::accepted, shm::kForever);
  incident.put_payload(8);
  incident.add(evidence::Start{3000, "test", {}, "none"});
  incident.state("/low", 0, 3000, shm::kNeverActive);
  incident.put_in_force(kOverride, 1, 2900);
  incident.arrive("/low", 2 * kInSecond, 2 * kInSecond + 1, Incident::Fate::accepted);
  incident.put_payload(8);
  EXPECT_THAT(replayed_from_1_to_3(incident.file()).out,
              HasSubstr("1 sample, 0 signals and 0 deactivations of 1 source in "));
}

TEST_F(PartOfTheTools, HasItsWinners) {
  const std::string low = "1970-01-01 00:00:01.000  /p  /low ";
  const std::string high = "1970-01-01 00:00:20.000  /p  /high ";
  const std::string again = "1970-01-01 00:00:30.000  /p  /low ";
  EXPECT_THAT(winners({"--from", "00:00:05", "--to", "00:00:20"}).out,
              AllOf(HasSubstr(low), Not(HasSubstr(high))));
  EXPECT_THAT(winners({"--from", "00:00:20"}).out,
              AllOf(HasSubstr(high), HasSubstr(again), Not(HasSubstr(low))));
  EXPECT_EQ(winners({"--to", "00:00:00.5", "--port", "/q"}).out,
            "nobody won in that time, at an input port that matches /q\n");
}

TEST_F(PartOfTheTools, MustLieInTheRecording) {
  // Its beginning and its end need not.
  EXPECT_THAT(simulated({"--from", "00:00:00", "--to", "00:05:00"}).out,
              HasSubstr("\n69 decisions: 69 equal,"));
  const auto expect = [&](const std::vector<std::string>& part, const std::string& text) {
    const auto result = simulated(part);
    EXPECT_EQ(result.exit_code, 2) << text;
    EXPECT_THAT(result.err, HasSubstr(text));
  };
  expect({"--from", "00:02:00"},
         "--from: \"00:02:00\" is not in the recording, which is from 1970-01-01 00:00:00.005 to "
         "1970-01-01 00:01:00.005");
  expect({"--to", "1969-12-31 23:59:00"}, "--to: \"1969-12-31 23:59:00\" is not in the recording");
  expect({"--from", "00:00:20", "--to", "1970-01-01 00:00:10"},
         "--to: \"1970-01-01 00:00:10\" is not after --from");
  expect({"--from", "noon"}, "--from: \"noon\" is not a time");
  EXPECT_EQ(winners({"--at", "00:00:20", "--from", "00:00:10"}).exit_code, 2);
  EXPECT_EQ(tool({"simulate", "model.xml", "--trace", "t.csv"}, {"--from", "00:00:10"}).exit_code,
            2);
}

}  // namespace
}  // namespace arbiter::test
