#include "bench/targets.hpp"

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
};

const std::vector<Ratio> kRatios{
    {"64 B spinning, p50, to a cache line", "delivery", "64 B, spinning", kArbiter, kCacheLine,
     kP50, 3},
    {"64 B blocking, p50, to a pipe", "delivery", "64 B, blocking", kArbiter, kPipe, kP50, 1.5},
    {"4 MiB to 64 B, spinning, p50", "delivery", "4 MiB, spinning", kArbiter, kArbiter, kP50, 1.2,
     "64 B, spinning"},
};

}  // namespace

std::vector<Verdict> judge(const Report& report) {
  std::vector<Verdict> verdicts;
  for (const Ratio& each : kRatios) {
    if (report.find(each.measure) == nullptr) continue;  // was not asked for
    Verdict verdict{each.name, each.limit, {}, "x"};
    const auto ours = figure(report, each.measure, each.of, each.ours, each.quantile);
    const auto theirs =
        figure(report, each.measure, each.their_case.empty() ? each.of : each.their_case,
               each.theirs, each.quantile);
    if (ours && theirs && *theirs > 0) verdict.measured = *ours / *theirs;
    verdicts.push_back(std::move(verdict));
  }
  return verdicts;
}

}  // namespace arbiter::bench
