// One way from publish() to the taken sample: small and large, spinning and blocking.
#include "bench/measures/measures.hpp"
#include "bench/measures/ping_pong.hpp"
#include "bench/peers/systems.hpp"

namespace arbiter::bench {
namespace {

std::string size_of(std::size_t bytes) {
  if (bytes >= 1024 * 1024) return std::to_string(bytes / 1024 / 1024) + " MiB";
  if (bytes >= 1024) return std::to_string(bytes / 1024) + " KiB";
  return std::to_string(bytes) + " B";
}

}  // namespace

Measure measure_delivery(const Effort& effort) {
  Measure measure{
      "delivery", "One-way delivery",
      "Half of a round trip between two processes on two cores: publish, delivery and "
      "take. A delay on one of the two ways counts half. The payload is not touched beyond its "
      "first word where the system does not copy it."};
  measure.x_label = "bytes";
  const std::vector<std::size_t> sizes =
      effort.quick ? std::vector<std::size_t>{64, 4 << 20}
                   : std::vector<std::size_t>{64, 4 << 10, 64 << 10, 1 << 20, 4 << 20};
  const Systems systems = all_systems();
  for (const Waiting waiting : {Waiting::kSpinning, Waiting::kBlocking}) {
    for (const std::size_t bytes : sizes) {
      Case one{size_of(bytes) + (waiting == Waiting::kSpinning ? ", spinning" : ", blocking")};
      one.x = static_cast<double>(bytes);
      std::vector<Result> absent_ones;
      auto contenders = ping_pongs(systems, {waiting, bytes, {}}, absent_ones);
      one.results = run_rounds(std::move(contenders), effort.budget());
      one.results.insert(one.results.end(), absent_ones.begin(), absent_ones.end());
      measure.cases.push_back(std::move(one));
    }
  }
  return measure;
}

}  // namespace arbiter::bench
