// Components and a daemon in processes of their own, in tiny queues, overriding each other at
// random; killed, stopped, their model swapped: and what they did, checked (history.hpp,
// accounts.hpp, tap_accounts.hpp). A run is a series of rounds, each with another plan that follows
// from the seed. The seed gives back the same decisions of all generators; how the processes
// interleave it cannot give back.
#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <string>

#include "cli/progress.hpp"
#include "tests/stress/round.hpp"

namespace {

using namespace arbiter::stress;

unsigned long long number(std::uint64_t value) { return value; }

void print(const char* what, const Distribution& times) {
  if (times.count() == 0) return;
  const auto us = [](std::uint64_t nanoseconds) { return static_cast<double>(nanoseconds) / 1000; };
  std::printf(
      "%s: half below %.1f us, 99%% below %.1f us, 99.99%% below %.1f us, longest %.1f us\n", what,
      us(times.quantile(0.5)), us(times.quantile(0.99)), us(times.quantile(0.9999)),
      us(times.longest));
}

void report(const Totals& totals, const Records& records, double seconds) {
  std::printf(
      "%llu operations checked: %llu arrivals, %llu samples taken (%llu while some source was "
      "surely active); %llu steps with empty takes, %llu model swaps, %llu rounds, %.0f s\n",
      number(totals.operations()), number(totals.checked.arrivals), number(totals.checked.takes),
      number(totals.checked.hard_takes), number(totals.steps), number(totals.swaps),
      number(totals.rounds), seconds);
  std::printf("%llu events seen through taps, and %llu that they were told to have lost\n",
              number(totals.taps.events), number(totals.taps.lost));
  if (totals.kills != 0) {
    std::printf("%llu killed: %llu publishers, %llu receivers, %llu relays, %llu taps\n",
                number(totals.kills), number(totals.killed_publishers),
                number(totals.killed_receivers), number(totals.killed_relays),
                number(totals.killed_taps));
    print("from a kill until a new process had opened the name", totals.takeovers);
  }
  if (totals.stops != 0) std::printf("%llu stopped and continued\n", number(totals.stops));
  if (totals.daemon_kills != 0) {
    std::printf("the daemon was killed %llu times\n", number(totals.daemon_kills));
    print("from a new daemon's start until it knew all ports", totals.readoptions);
  }
  print("pauses between two steps, nobody killed or stopped", totals.pauses);
  print("pauses of the others while some are", totals.pauses_in_trouble);
  std::printf("%llu failures\n", number(records.failures.load()));
}

void run(const Options& options, Records& records, Totals& totals) {
  const std::int64_t begin = read_clock();
  const auto seconds = [&] { return static_cast<double>(read_clock() - begin) / 1e9; };
  const auto goes_on = [&] {
    if (options.kills != 0) return totals.kills < options.kills;
    if (options.daemon_kills != 0) return totals.daemon_kills < options.daemon_kills;
    if (options.stops != 0) return totals.stops < options.stops;
    if (options.operations != 0) return totals.operations() < options.operations;
    return seconds() < options.seconds;
  };
  arbiter::cli::ProgressLine progress;
  for (std::uint64_t i = 0; goes_on() && !records.has_failed(); ++i) {
    const Plan plan = make_plan(options, options.seed + i);
    // Every other round is left in peace, as a measure for the others' pauses.
    const bool peace = options.kills + options.stops != 0 && i % 2 == 0;
    Round round(options, plan, records, totals);
    round.run(peace ? 0 : options.kills - std::min(options.kills, totals.kills),
              peace ? 0 : options.stops - std::min(options.stops, totals.stops),
              options.keep_daemon_dead || options.daemon_kills != 0);
    progress.show([&] {
      return std::to_string(progress.elapsed().count()) +
             " s: " + std::to_string(totals.operations()) + " operations checked in " +
             std::to_string(totals.rounds) + " rounds" +
             (totals.kills == 0 ? "" : ", " + std::to_string(totals.kills) + " killed");
    });
  }
  progress.clear();
  report(totals, records, seconds());
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  std::printf("seed %llu\n", number(options.seed));
  std::fflush(stdout);
  Records& records = Records::make();
  Totals totals;
  try {
    run(options, records, totals);
  } catch (const std::exception& error) {
    records.fail(error.what());
  }
  if (!records.has_failed()) return 0;
  std::fprintf(stderr, "FAILED in round %llu; --seed %llu makes the same decisions from there on\n",
               number(totals.rounds), number(options.seed + totals.rounds - 1));
  return 1;
}
