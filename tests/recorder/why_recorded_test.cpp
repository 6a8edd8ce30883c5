// `arbiter simulate --recording --why`: what changed the winners, and what kept arrivals out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/recorder/in_zone.hpp"
#include "tests/recorder/overridden.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TEST(SimulateRecording, TellsWhyWinnersChangedAndArrivalsWereDiscarded) {
  const TemporaryDirectory directory;
  Incident incident;
  const std::string file = overridden_for_a_while(incident);
  const auto result = arbiter_in_utc({"simulate", "--recording", file, "--why=/p"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  for (const char* line : {"1970-01-01 00:00:00.005 (0.000000100 s before the first arrival)  /p  "
                           "/high wins as this begins\n",
                           "\n1970-01-01 00:00:00.005 (0.000000050 s before the first arrival)  /p "
                           " /high -> idle  because /high went inactive",
                           "\n1970-01-01 00:00:00.005 (+0.000000000 s)  /p  idle -> /low  because "
                           "/low became active\n",
                           "\n1970-01-01 00:00:00.005 (+0.000000100 s)  /p  /low -> /high  because "
                           "/high became active; /low is inhibited by "
                           "behaviour \"High\" (model.xml:",
                           "\n1970-01-01 00:00:00.005 (+0.000000200 s)  /p  /low discarded: "
                           "inhibited by behaviour \"High\" (model.xml:",
                           "  /p  /low was discarded 3 more times for that reason, until "
                           "1970-01-01 00:00:00.005 (+0.000000230 s)\n",
                           "\n1970-01-01 00:00:00.005 (+0.000000300 s)  /p  /high -> /low  because "
                           "/high was deactivated"}) {
    EXPECT_THAT("\n" + result.out, HasSubstr(line));
  }
  const std::string other = directory.write("other.xml", kReversed);
  const auto under = arbiter_in_utc({"simulate", other, "--recording", file, "--why", "--json"});
  EXPECT_EQ(under.exit_code, 0) << under.err;
  EXPECT_THAT(under.out, HasSubstr(R"("event":"discarded")"));
  EXPECT_THAT(under.out, HasSubstr(R"("inhibitor":{"kind":"behaviour","name":"Low")"));
  EXPECT_EQ(arbiter_in_utc({"simulate", "--recording", file, "--why=/q"}).exit_code, 1);
}

// What held as it began, and what happened then. The wall clock is 5 ms ahead.
TEST(SimulateRecording, TellsWhyAtATimeOfDay) {
  constexpr shm::Nanoseconds kMs = 1'000'000;
  std::string model = kOverride;
  Incident incident(model.replace(model.find("500ns"), 5, "500ms"));
  incident.arrive("/low", 1000 * kMs, 1000 * kMs, Incident::Fate::accepted, 500 * kMs);
  incident.arrive("/high", 2000 * kMs, 2000 * kMs, Incident::Fate::accepted, 500 * kMs);
  incident.arrive("/low", 2200 * kMs, 2200 * kMs, Incident::Fate::discarded, 500 * kMs);
  const std::string file = incident.file(3000 * kMs);
  const auto at = [&](const std::string& time, const std::string& more = "--why=/p") {
    return arbiter_in_utc({"simulate", "--recording", file, more, "--at", time});
  };
  const std::string low =
      "1970-01-01 00:00:01.005 (+0.000000000 s)  /p  idle -> /low  because /low became active\n";
  const std::string idle =
      "1970-01-01 00:00:01.505 (+0.500000000 s)  /p  /low -> idle  because /low went inactive, 500 "
      "ms after its last arrival\n";
  EXPECT_EQ(at("00:00:01.250").out, low);
  EXPECT_EQ(at("00:00:01").out, low + idle);
  EXPECT_EQ(at("00:00:01.600").out, idle);
  EXPECT_EQ(at("00:00:00").out, "nobody won at 00:00:00, and nothing happened\n");
  const auto second = at("00:00:02");
  EXPECT_EQ(second.exit_code, 0) << second.err;
  EXPECT_THAT(
      second.out,
      testing::StartsWith(idle + "1970-01-01 00:00:02.005 (+1.000000000 s)  /p  idle -> /high "));
  EXPECT_THAT(second.out,
              HasSubstr("\n1970-01-01 00:00:02.205 (+1.200000000 s)  /p  /low discarded: "));
  EXPECT_THAT(second.out,
              HasSubstr("\n1970-01-01 00:00:02.505 (+1.500000000 s)  /p  /high -> /low "));
  EXPECT_THAT(second.out,
              HasSubstr("\n1970-01-01 00:00:02.705 (+1.700000000 s)  /p  /low -> idle "));
  EXPECT_EQ(std::count(second.out.begin(), second.out.end(), '\n'), 5) << second.out;
  EXPECT_THAT(at("00:00:02.600").out, testing::StartsWith("1970-01-01 00:00:02.505 (+1.5"));
  const auto lines =
      arbiter_in_utc({"simulate", "--recording", file, "--why", "--json", "--at", "00:00:02.6"});
  EXPECT_EQ(json::parse(lines.out)["time"], "1970-01-01 00:00:02.505");
  EXPECT_EQ(at("00:00:09").exit_code, 2) << "not in the recording";
  EXPECT_EQ(at("00:00:02", "--json").exit_code, 2) << "without --why";
}

// Each by what it says; what was active stays so.
TEST(SimulateRecording, TellsWhyByTheModelThatWasInForce) {
  Incident incident;
  incident.arrive("/low", 1100, 1101, Incident::Fate::accepted);
  incident.arrive("/high", 1200, 1201, Incident::Fate::accepted);
  incident.put_in_force(kReversed, 2, 1300);
  incident.arrive("/high", 1310, 1311, Incident::Fate::discarded);
  const auto result = arbiter_in_utc({"simulate", "--recording", incident.file(), "--why"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(
      result.err,
      HasSubstr("arbiter: 1970-01-01 00:00:00.005 (+0.000000200 s), model 2 came into force\n"));
  EXPECT_THAT(
      result.out,
      HasSubstr("\n1970-01-01 00:00:00.005 (+0.000000200 s)  /p  /low wins as this begins\n"));
  EXPECT_THAT(
      result.out,
      HasSubstr("\n1970-01-01 00:00:00.005 (+0.000000210 s)  /p  /high discarded: inhibited by "));
}

// Nobody wins there by the new one: it does not connect who commanded.
TEST(SimulateRecording, TellsThatAModelEndsACommand) {
  Incident incident;
  incident.arrive("/low", 1100, 1101, Incident::Fate::accepted);
  evidence::ModelChange change;
  change.time = change.seen = 1300;
  change.generation = 2;
  change.name = "hands off";
  change.how = "switch";
  change.by = "root";
  change.has_texts = true;
  change.files = {
      {"off.xml", "<behaviors><arbiter at='/p'><select from='/high'/></arbiter></behaviors>"}};
  incident.add(change);
  incident.arrive("/low", 1310, 1311, Incident::Fate::none);
  const std::string file = incident.file(1400);
  const auto result = arbiter_in_utc({"simulate", "--recording", file, "--why=/p"});
  EXPECT_THAT(result.out, testing::EndsWith("(+0.000000200 s)  /p  /low -> idle  because model 2 "
                                            "\"hands off\" came into force (switch, by root)\n"));
  const auto lines = arbiter_in_utc({"simulate", "--recording", file, "--why", "--json"}).out;
  const json last = json::parse(lines.substr(lines.rfind('\n', lines.size() - 2) + 1));
  EXPECT_EQ(last["event"], "change");
  EXPECT_EQ(last["old"], "/low");
  EXPECT_TRUE(last["winner"].is_null());
  EXPECT_EQ(last["model"], 2);
}

// The first model need not have the port.
TEST(SimulateRecording, TellsWhyAtAPortThatALaterModelHas) {
  Incident incident;
  incident.arrive("/low", 1100, 1101, Incident::Fate::accepted);
  incident.put_in_force("<behaviors><arbiter at='/q'><select from='/low'/></arbiter></behaviors>",
                        2, 1300);
  incident.arrive("/low", 1310, 1311, Incident::Fate::accepted);
  const auto result = arbiter_in_utc({"simulate", "--recording", incident.file(), "--why=/q"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("model 1 has no input port /q: what it decided is left out\n"));
  EXPECT_THAT(result.out, HasSubstr("  /q  /low wins as this begins\n"));
  EXPECT_THAT(arbiter_in_utc({"simulate", "--recording", incident.file(), "--why=/low"}).err,
              HasSubstr("/low is an output port, connected to /q"));
}

}  // namespace
}  // namespace arbiter::test
