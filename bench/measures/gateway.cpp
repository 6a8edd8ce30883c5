// What it costs to have Arbiter between two programs that know nothing of it, beside a relay that
// only takes and publishes, and beside nothing.
#include <cstdio>

#include "bench/measures/measures.hpp"
#include "bench/measures/passage.hpp"

namespace arbiter::bench {
namespace {

struct Between {
  Way way;
  const char* system;
  Role role;
};
const Between kBetween[] = {{Way::kGateway, kThroughGateway, Role::kOurs},
                            {Way::kRelay, kThroughRelay, Role::kPeer},
                            {Way::kDirect, kStraight, Role::kFloor}};

// Those that could be set up, and those that could not.
struct Ways {
  std::vector<Contender> contenders;
  std::vector<std::shared_ptr<Passage>> passages;
  std::vector<Result> absent_ones;
};

Ways set_up(Passing& passing, const PassageOptions& options, bool has_direct) {
  Ways ways;
  for (const Between& each : kBetween) {
    if (each.way == Way::kDirect && !has_direct) continue;
    try {
      auto passage = std::make_shared<Passage>(passing, each.way, options);
      ways.passages.push_back(passage);
      ways.contenders.push_back(
          {each.system, each.role, [passage](double seconds) { return passage->round(seconds); }});
    } catch (const std::exception& error) {
      ways.absent_ones.push_back(absent(each.system, each.role, error.what()));
    }
  }
  return ways;
}

// "gateway 14.2, arbiterd 0.0 us"
std::string parts_of(const Passage& passage, double per, const char* unit) {
  std::string text;
  for (const Passage::Use& each : passage.uses()) {
    char part[80];
    std::snprintf(part, sizeof part, "%s%s %.3g", text.empty() ? "" : ", ", each.program.c_str(),
                  static_cast<double>(each.ns) / per);
    text += part;
  }
  return passage.uses().size() < 2 ? "" : text + " " + unit;
}

// The rounds' times, and behind them what the processes in between have used of the processors:
// `share` of a processor, or else for each sample.
void measure_ways(Measure& measure, const std::string& name, Passing& passing,
                  const PassageOptions& options, const Budget& budget, bool share) {
  Ways ways = set_up(passing, options, !share);
  Case one_way{name + kOneWay};
  Case time{name + (share ? kShareOfProcessor : kProcessorTime)};
  if (!share) one_way.x = time.x = static_cast<double>(options.bytes);
  time.unit = share ? "%" : "ns";
  one_way.results = run_rounds(std::move(ways.contenders), budget);
  for (std::size_t i = 0; i < ways.passages.size(); ++i) {
    Result& result = one_way.results[i];
    const Passage& passage = *ways.passages[i];
    if (result.note.empty()) result.note = passage.remarks();
    if (passage.uses().empty() || passage.sent() == 0) continue;
    const double all = share ? static_cast<double>(passage.duration_ns()) / 100
                             : static_cast<double>(passage.sent());
    time.results.push_back(
        {result.system,
         result.role,
         {},
         static_cast<double>(passage.used_ns()) / all,
         share ? parts_of(passage, all, "%") : parts_of(passage, all * 1000, "us")});
  }
  for (Result& each : ways.absent_ones) one_way.results.push_back(std::move(each));
  measure.cases.push_back(std::move(one_way));
  measure.cases.push_back(std::move(time));
}

struct Size {
  const char* name;
  std::size_t bytes;
  std::int64_t period_ns;
};
constexpr Size kSizes[] = {
    {"64 B", 64, 1'000'000}, {"64 KiB", 64 << 10, 1'000'000}, {"1 MiB", 1 << 20, 5'000'000}};

constexpr const char* kHow =
    " Three ways side by side: straight from the publisher to the subscriber; through a relay, a "
    "process that takes and publishes; and through the gateway, with an arbiterd whose rule reads "
    "eight activities. One way, from the publisher's reading of the clock before publish() to the "
    "subscriber's, a sample a millisecond (of 1 MiB: in five), all ends blocking, the processes "
    "where the kernel puts them. The processor time of a sample is that of the relay, or of the "
    "gateway, its supervisor and arbiterd.";

Measure measure_sizes(Measure measure, std::unique_ptr<Passing> (*make)(), const Effort& effort) {
  measure.x_label = "bytes";
  const Budget budget = effort.quick ? Budget{3, 0.3} : Budget{20, 0.4};
  std::unique_ptr<Passing> passing;
  try {
    passing = make();
  } catch (const std::exception& error) {
    measure.cases.push_back({std::string(kSizes[0].name) + kOneWay,
                             {},
                             {absent(kThroughGateway, Role::kOurs, error.what())}});
    return measure;
  }
  for (const Size& size : kSizes) {
    measure_ways(measure, size.name, *passing, {size.bytes, size.period_ns, 1}, budget, false);
  }
  return measure;
}

}  // namespace

Measure measure_gateway_iceoryx(const Effort& effort) {
  return measure_sizes({"gateway-iceoryx", "Through the gateway: iceoryx",
                        std::string("Between two programs of iceoryx.") + kHow +
                            " The relay waits in a WaitSet, and copies a chunk into one of its "
                            "own."},
                       iceoryx_passing, effort);
}

Measure measure_gateway_dds(const Effort& effort) {
  return measure_sizes({"gateway-dds", "Through the gateway: DDS",
                        std::string("Between two programs of Cyclone DDS on the loopback "
                                    "interface, reliable, keep last 10.") +
                            kHow +
                            " The relay takes serialised samples in Cyclone's listener, and "
                            "publishes them from there as they are."},
                       cyclone_passing, effort);
}

Measure measure_gateway_mux(const Effort& effort) {
  Measure measure{
      "gateway-mux", "twist_mux's job",
      "Two publishers of geometry_msgs/msg/Twist, each at 100 Hz, and one subscriber, by Cyclone "
      "DDS: of two priorities the higher one passes. By the gateway with an arbiterd, and by a "
      "multiplexer with listeners of Cyclone's that does nothing else. What is used of one "
      "processor, in user and kernel mode, by the multiplexer, or by gateway and arbiterd."};
  const std::unique_ptr<Passing> passing = twist_passing();
  const Budget budget = effort.quick ? Budget{3, 1.0} : Budget{10, 2.0};
  measure_ways(measure, kTwoInputs, *passing, {48, 5'000'000, 2}, budget, true);
  return measure;
}

}  // namespace arbiter::bench
