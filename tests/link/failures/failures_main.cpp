// Hosts with networks of their own, joined by links, and what can befall them: cables cut, frames
// lost, doubled and late, processes stopped and killed. A checker over the recordings of all hosts
// says what was wrong (checker.hpp). A run is a series of rounds, each with another plan that
// follows from the seed; how processes and frames interleave, the seed cannot give back.
#include <signal.h>

#include <cstdio>
#include <exception>
#include <initializer_list>
#include <random>
#include <string>

#include <CLI/CLI.hpp>

#include "tests/link/cables.hpp"
#include "tests/link/failures/component.hpp"
#include "tests/link/failures/round.hpp"

namespace {

using namespace arbiter::failures;

constexpr int kSkipped = 77;
// Of samples that are asked for: some may come behind the next one, where processes wait for a
// processor.
constexpr std::uint64_t kEnoughAsked = 10;

unsigned long long number(std::uint64_t value) { return value; }

void report_troubles(const Totals& totals) {
  std::printf("%-28s", "what happened, by how long");
  for (const char* const name : Happenings::kNames) std::printf("%10s", name);
  std::printf("   back again\n");
  for (unsigned i = 0; i < kTroubles; ++i) {
    const auto trouble = static_cast<Trouble>(i);
    const auto its = totals.troubles.find(trouble);
    const Happenings happened = its == totals.troubles.end() ? Happenings{} : its->second;
    const auto back = totals.recoveries.find(trouble);
    std::printf("%-28s", name_of(trouble));
    for (const std::uint64_t each : happened.lasting) std::printf("%10llu", number(each));
    std::printf("   %s\n", back == totals.recoveries.end() ? "" : back->second.text().c_str());
  }
}

std::uint64_t all_of(const Totals& totals, std::initializer_list<Trouble> troubles) {
  std::uint64_t sum = 0;
  for (const Trouble each : troubles) {
    const auto its = totals.troubles.find(each);
    if (its == totals.troubles.end()) continue;
    for (const std::uint64_t count : its->second.lasting) sum += count;
  }
  return sum;
}

void report_in_short(const Totals& totals) {
  Happenings cuts;
  for (const auto& [trouble, its] : totals.troubles) {
    if (!is_cut(trouble)) continue;
    for (std::size_t i = 0; i < cuts.lasting.size(); ++i) cuts.lasting[i] += its.lasting[i];
  }
  std::printf(
      "cuts of less than 1 s: %llu, of 1 s and a little more: %llu, of 10 s: %llu, of 60 s: %llu; "
      "%llu of these one way, %llu of a network in two\n%llu kills, %llu times stopped\n",
      number(cuts.lasting[0]), number(cuts.lasting[1]), number(cuts.lasting[2]),
      number(cuts.lasting[3]), number(all_of(totals, {Trouble::mute, Trouble::deaf})),
      number(all_of(totals, {Trouble::split})),
      number(all_of(totals, {Trouble::link_kill, Trouble::daemon_kill, Trouble::component_kill,
                             Trouble::host_kill, Trouble::switch_death})),
      number(all_of(totals, {Trouble::host_stop, Trouble::link_stop})));
}

void report_losers_and_ends(const Totals& totals) {
  const Checked& checked = totals.checked;
  std::printf(
      "%llu rounds in which large samples that lose stay at home: %llu did, by what links counted "
      "in the end; %llu won, of which %llu came before the next one\n%llu deactivations "
      "came between the right samples; deactivations, where nothing follows: %s\n",
      number(totals.rounds_with_losers), number(checked.withheld), number(checked.asked),
      number(checked.completed), number(checked.ends), totals.ends.text().c_str());
}

// What a run must have seen, else it has proved less than it says.
Findings missing_in(const Totals& totals) {
  const Checked& checked = totals.checked;
  Findings found;
  if (totals.rounds_with_losers != 0 && checked.withheld == 0) {
    found.emplace_back("no sample has stayed at home");
  }
  if (checked.asked >= kEnoughAsked && 4 * checked.completed < checked.asked) {
    found.emplace_back("samples that stayed at home and won did not come");
  }
  return found;
}

void report(const Totals& totals, double seconds) {
  const Checked& checked = totals.checked;
  std::printf("%llu rounds, %.0f s:", number(totals.rounds), seconds);
  for (const auto& [hosts, rounds] : totals.rounds_of) {
    std::printf(" %llu of %u hosts,", number(rounds), hosts);
  }
  std::printf(
      " %llu with an interface that came after its link\n%llu frames passed on: %llu lost, %llu "
      "doubled, %llu late, %llu of them overtaken, %llu in cuts\n",
      number(totals.late_interfaces), number(totals.passed.frames), number(totals.passed.lost),
      number(totals.passed.doubled), number(totals.passed.delayed), number(totals.passed.overtaken),
      number(totals.passed.cut));
  report_troubles(totals);
  report_in_short(totals);
  std::printf(
      "%llu samples from other hosts arrived, %llu of them older than T/2, none older than T (of "
      "%llu the age is not known exactly)\n%llu never arrived, between others that did; counted as "
      "lost, late or too soon: %llu\n%llu decisions were taken again (%llu of them may have been "
      "one or the other); %llu commands had no rival\n",
      number(checked.arrivals), number(checked.old), number(checked.unsure),
      number(checked.missing), number(checked.counted), number(checked.decisions),
      number(checked.uncertain), number(checked.pairs));
  std::printf(
      "%llu samples of a source that several hosts have open arrived at others, which changed the "
      "speaker %llu times\n%llu models came into force by switches of all hosts; of these %llu "
      "were "
      "made by none, %llu not by all\n",
      number(checked.shared), number(checked.speakers), number(checked.switched),
      number(checked.refused), number(checked.partly));
  report_losers_and_ends(totals);
  std::printf(
      "the last in command, when nothing else is active: %s\nthe next speaker, when one is gone: "
      "%s\nthe port of a source that is active for ever, closed in a cut: %s\nall back after all: "
      "%s\n",
      totals.fallbacks.text().c_str(), totals.successions.text().c_str(),
      totals.closings.text().c_str(), totals.flows.text().c_str());
}

int run(const Options& options) {
  if (const std::string why = arbiter::test::why_no_networks(); !why.empty()) {
    std::printf("skipped: %s\n", why.c_str());
    return kSkipped;
  }
  // Inherited: a component that has only been started keeps them until it is ready.
  sigset_t kept;
  sigemptyset(&kept);
  sigaddset(&kept, SIGUSR1);
  sigaddset(&kept, SIGUSR2);
  sigprocmask(SIG_BLOCK, &kept, nullptr);
  std::printf("seed %llu, commit %s\n", number(options.seed), options.commit.c_str());
  const Nanoseconds begin = now();
  const auto seconds = [&] { return static_cast<double>(now() - begin) / 1e9; };
  Totals totals;
  for (std::uint64_t i = 0;; ++i) {
    const Plan plan = make_plan(options, options.seed + i);
    std::printf("round %llu, seed %llu: %s", number(i + 1), number(plan.seed), plan.text().c_str());
    std::fflush(stdout);
    Round round(options, plan, totals);
    Findings found = round.run();
    const bool is_last = !found.empty() || seconds() >= options.seconds;
    if (!is_last) continue;
    if (found.empty()) found = missing_in(totals);
    report(totals, seconds());
    if (found.empty()) return 0;
    for (const std::string& each : found) std::printf("FOUND: %s\n", each.c_str());
    std::printf("FAILED; --seed %llu makes the same plan again\n", number(plan.seed));
    return 1;
  }
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  options.seed = std::random_device()() & 0x7fffffff;
  ComponentOptions component;
  CLI::App app("Hosts that are joined by links, and all that can befall them");
  app.add_option("--seed", options.seed, "Makes the plans");
  app.add_option("--seconds", options.seconds, "Begins rounds for so long")->capture_default_str();
  app.add_option("--hosts", options.hosts, "3 to 5; else each round another number")
      ->check(CLI::Range(3, 5));
  app.add_option("--rate", options.rate, "Samples of each source in a second")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--keep", options.keep,
                 "Where recordings and logs are left if something is found");
  app.add_option("--commit", options.commit, "Of what is tested, for the report")
      ->capture_default_str();
  app.add_flag("--bounds", options.has_bounds,
               "Who is to command again does so in time, where processes had a processor");
  std::vector<std::string> names;
  for (unsigned i = 0; i < kTroubles; ++i) names.emplace_back(name_of(static_cast<Trouble>(i)));
  app.add_option("--only", options.only, "A trouble that happens, such as \"noise\"; repeatable")
      ->check(CLI::IsMember(names));
  app.add_flag("--short", options.is_short, "One round, in which nothing lasts long");
  app.add_option("--component", component.instance)->group("");
  app.add_option("--number", component.host)->group("");
  app.add_option("--life", component.life)->group("");
  app.add_option("--period", component.period_ns)->group("");
  app.add_flag("--rival", component.is_rival)->group("");
  std::string model;
  int victim = 0;
  app.add_option("--switch", model)->group("");
  app.add_option("--kill", victim)->group("");
  CLI11_PARSE(app, argc, argv);
  try {
    if (component.instance.empty()) return run(options);
    if (!model.empty()) return switch_and_kill(component.instance, model, victim);
    component.seed = options.seed;
    return run_component(component);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
