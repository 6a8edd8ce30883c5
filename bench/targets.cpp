#include "bench/targets.hpp"

#include "bench/measures/measures.hpp"
#include "bench/peers/systems.hpp"

namespace arbiter::bench {
namespace {

constexpr double kP50 = 0.5;
constexpr double kP99 = 0.99;
constexpr double kP999 = 0.999;

std::optional<double> figure(const Report& report, const std::string& measure,
                             const std::string& of, const std::string& system, double quantile) {
  const Measure* const found = report.find(measure);
  const Case* const one = found == nullptr ? nullptr : found->find(of);
  const Result* const result = one == nullptr ? nullptr : one->find(system);
  if (result == nullptr) return std::nullopt;
  if (result->value) return result->value;
  if (result->ns.count() == 0) return std::nullopt;
  return result->ns.quantile(quantile);
}

// `ours` is at most `limit` times `theirs`.
struct Ratio {
  std::string name;
  std::string measure;
  std::string of;
  std::string ours;
  std::string theirs;
  double quantile;
  double limit;
  std::string their_case{};  // else the same
  std::string group{};       // Verdict::group
};

const std::string kSpinning = "64 B, spinning";
const std::string kBlocking = "64 B, blocking";
const std::string kOne = "1 input port";
const std::string kMany = "64 input ports";
const std::string kLoser = "loses, 8 activities";
const std::string kWinner = "wins, 8 activities";

const std::vector<Ratio> kRatios{
    {"64 B spinning, p50, to iceoryx", "delivery", kSpinning, kArbiter, kIceoryx, kP50, 0.30},
    {"64 B spinning, p99, to iceoryx", "delivery", kSpinning, kArbiter, kIceoryx, kP99, 0.35},
    {"64 B spinning, p99.9, to iceoryx", "delivery", kSpinning, kArbiter, kIceoryx, kP999, 0.7},
    {"64 B spinning, p50, to a cache line", "delivery", kSpinning, kArbiter, kCacheLine, kP50, 3},
    {"64 B blocking, p50, to iceoryx", "delivery", kBlocking, kArbiter, kIceoryx, kP50, 0.65},
    {"64 B blocking, p50, to a pipe", "delivery", kBlocking, kArbiter, kPipe, kP50, 1.5},
    {"64 B blocking, p50, to Cyclone DDS", "delivery", kBlocking, kArbiter, kCyclone, kP50, 0.5},
    {"4 MiB to 64 B, spinning, p50", "delivery", "4 MiB, spinning", kArbiter, kArbiter, kP50, 1.2,
     kSpinning},
    {"a loser's publish(), p50, to a clock read", "publish", kOne, kLoser, kClockRead, kP50, 2},
    {"publish() to 64 ports, p50, to iceoryx", "publish", kMany, kWinner, kIceoryx, kP50, 0.05},
    {"a publish() beside arbiter top, p99, to alone", "watched", "16 ports", kWatched, kUnwatched,
     kP99, 1.1},
    {"between hosts, 64 B, p99, to Cyclone DDS", "hosts-delivery", kSmallBetweenHosts,
     kThroughLinks, kCyclone, kP99, 2},
    // Rates: the larger the better, so it is Cyclone's that is `ours`.
    {"between hosts, 64 B, Cyclone DDS's rate to a link's", "hosts-delivery", kSmallThroughput,
     kCyclone, kThroughLinks, kP50, 1 / 0.6},
    {"between hosts, 1 MiB, Cyclone DDS's rate to a link's", "hosts-delivery", kLargeThroughput,
     kCyclone, kThroughLinks, kP50, 1 / 0.95},
    {"a losing 1 MiB camera, bytes on the wire, to a winning one", "hosts-losers", kOnTheWire,
     kLosesThere, kWinsThere, kP50, 0.01},
};

// What a sample through a gateway may cost, of what it costs through a relay of the same
// middleware.
struct GatewayTarget {
  const char* name;
  const char* measure;
  double limit;
};
constexpr GatewayTarget kGatewayTargets[] = {{"iceoryx", "gateway-iceoryx", 1.5},
                                             {"DDS", "gateway-dds", 1.15}};

std::vector<Ratio> ratios_of_gateways() {
  std::vector<Ratio> ratios;
  for (const GatewayTarget& each : kGatewayTargets) {
    for (const std::string size : {"64 B", "64 KiB", "1 MiB"}) {
      const auto add = [&](const char* what, const std::string& of, double quantile) {
        ratios.push_back(
            {std::string(each.name) + " gateway, " + size + ", " + what + ", to a relay",
             each.measure,
             size + of,
             kThroughGateway,
             kThroughRelay,
             quantile,
             each.limit,
             {},
             kGateways});
      };
      add("p50", kOneWay, kP50);
      add("p99", kOneWay, kP99);
      add("processor", kProcessorTime, kP50);
    }
  }
  return ratios;
}

// `ours` is at most `limit` more than `theirs`, or than nothing.
struct Excess {
  std::string name;
  std::string measure;
  std::string of;
  std::string ours;
  std::string theirs;
  double limit;
  std::string unit = "ns";
  std::string their_case{};  // else the same
};

const std::vector<Excess> kExcesses{
    {"a loser's publish() at 64 ports, p50", "publish", kMany, kLoser, {}, 150},
    {"a tapped publish(), p50, over one that is not", "publish", kOne, kWinner + ", tapped",
     kWinner, 15},
    {"take(), nothing waits, 1 source, p50", "take", "1 source", "nothing waits", {}, 5},
    {"take(), nothing waits, 64 sources, p50", "take", "64 sources", "nothing waits", {}, 50},
    {"take() of a sample, p50, over its cache lines", "hit", "8 samples wait", kArbiter,
     "its cache lines alone", 30},
    {"decision, conjunction of 8, p50", "decide", "8 sources", "conjunction", {}, 8},
    {"decision, conjunction of 64, p50", "decide", "64 sources", "conjunction", {}, 40},
    {"first publish() under a new model, p50, over others", "swap",
     "the publish() that first meets a new model", "first under a new model", "models refused",
     1000, "ns", "time of a publish()"},
    {"attach of 1000 ports", "scale", "attach", "arbiter: 1000 ports", {}, 1e9},
    {"CPU of an idle daemon", "scale", "daemon idle", "arbiterd", {}, 0, "%"},
    {"twist_mux's job, of a processor",
     "gateway-mux",
     kTwoInputs + std::string(kShareOfProcessor),
     kThroughGateway,
     {},
     1,
     "%"},
    {"10 000 behaviours compiled and proved", "compile", "10000 behaviours", "arbiter", {}, 1e9},
};

// Two threads more are woken on the way, which is no link's doing: what that costs, Cyclone's own
// programs show, with as many wake-ups more in the same places.
std::optional<Verdict> between_hosts(const Report& report) {
  if (report.find("hosts-delivery") == nullptr) return std::nullopt;
  const auto of = [&](const char* system) {
    return figure(report, "hosts-delivery", kSmallBetweenHosts, system, kP50);
  };
  Verdict verdict{
      "between hosts, 64 B, p50 without two wake-ups, to Cyclone DDS", 1.3, {}, "x", {}};
  const auto ours = of(kThroughLinks);
  const auto theirs = of(kCyclone);
  const auto woken = of(kCycloneWoken);
  if (ours && theirs && woken && *theirs > 0) {
    verdict.measured = (*ours - (*woken - *theirs)) / *theirs;
  }
  return verdict;
}

}  // namespace

std::vector<Verdict> judge(const Report& report) {
  std::vector<Verdict> verdicts;
  std::vector<Ratio> ratios = kRatios;
  for (Ratio& each : ratios_of_gateways()) ratios.push_back(std::move(each));
  for (const Ratio& each : ratios) {
    if (report.find(each.measure) == nullptr) continue;  // was not asked for
    Verdict verdict{each.name, each.limit, {}, "x", each.group};
    const auto ours = figure(report, each.measure, each.of, each.ours, each.quantile);
    const auto theirs =
        figure(report, each.measure, each.their_case.empty() ? each.of : each.their_case,
               each.theirs, each.quantile);
    if (ours && theirs && *theirs > 0) verdict.measured = *ours / *theirs;
    verdicts.push_back(std::move(verdict));
  }
  for (const Excess& each : kExcesses) {
    if (report.find(each.measure) == nullptr) continue;
    Verdict verdict{each.name, each.limit, {}, each.unit, {}};
    const auto ours = figure(report, each.measure, each.of, each.ours, kP50);
    const auto theirs =
        each.theirs.empty()
            ? 0.0
            : figure(report, each.measure, each.their_case.empty() ? each.of : each.their_case,
                     each.theirs, kP50);
    if (ours && theirs) verdict.measured = *ours - *theirs;
    verdicts.push_back(std::move(verdict));
  }
  if (auto verdict = between_hosts(report)) verdicts.push_back(std::move(*verdict));
  return verdicts;
}

}  // namespace arbiter::bench
