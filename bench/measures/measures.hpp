// What is measured. Each in a file of its own; main.cpp runs them in this order.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bench/harness/report.hpp"
#include "bench/harness/rounds.hpp"

namespace arbiter::bench {

struct Effort {
  bool quick = false;
  // For measures that run rounds, per contender.
  [[nodiscard]] Budget budget() const { return quick ? Budget{5, 0.04} : Budget{20, 0.1}; }
};

struct MeasureEntry {
  std::string name;
  std::function<Measure(const Effort&)> run;
};

inline const char* const kClockRead = "clock read";
inline const char* const kThroughGateway = "through the gateway";
inline const char* const kThroughRelay = "through a relay";
inline const char* const kStraight = "straight";
inline const char* const kOneWay = ", one way";
inline const char* const kProcessorTime = ", processor time of a sample";
inline const char* const kShareOfProcessor = ", share of a processor";
inline const char* const kTwoInputs = "two inputs at 100 Hz";
inline const char* const kThroughLinks = "through two links";
inline const char* const kWakeUp = "a wake-up";
inline const char* const kCycloneWoken = "Cyclone DDS, two wake-ups more";
inline const char* const kSmallBetweenHosts = "64 B, one way";
inline const char* const kSmallThroughput = "64 B, throughput";
inline const char* const kLargeThroughput = "1 MiB, throughput";
inline const char* const kOnTheWire = "1 MiB at 30 Hz, on the wire";
inline const char* const kWinsThere = "wins at the other host";
inline const char* const kLosesThere = "loses at the other host";
inline const char* const kUnwatched = "alone";
inline const char* const kWatched = "beside arbiter top";

Measure measure_compile(const Effort& effort);
Measure measure_decide(const Effort& effort);
Measure measure_delivery(const Effort& effort);
Measure measure_failover(const Effort& effort);
Measure measure_gateway_dds(const Effort& effort);
Measure measure_gateway_iceoryx(const Effort& effort);
Measure measure_gateway_mux(const Effort& effort);
Measure measure_hit(const Effort& effort);
Measure measure_hosts_delivery(const Effort& effort);
Measure measure_hosts_losers(const Effort& effort);
Measure measure_hosts_scale(const Effort& effort);
Measure measure_load(const Effort& effort);
Measure measure_publish(const Effort& effort);
Measure measure_scale(const Effort& effort);
Measure measure_swap(const Effort& effort);
Measure measure_take(const Effort& effort);
Measure measure_takeover(const Effort& effort);
Measure measure_throughput(const Effort& effort);
Measure measure_watched(const Effort& effort);

inline std::vector<MeasureEntry> all_measures() {
  return {
      {"delivery", measure_delivery},
      {"publish", measure_publish},
      {"take", measure_take},
      {"hit", measure_hit},
      {"decide", measure_decide},
      {"takeover", measure_takeover},
      {"failover", measure_failover},
      {"swap", measure_swap},
      {"load", measure_load},
      {"throughput", measure_throughput},
      {"scale", measure_scale},
      {"compile", measure_compile},
      {"watched", measure_watched},
      {"gateway-iceoryx", measure_gateway_iceoryx},
      {"gateway-dds", measure_gateway_dds},
      {"gateway-mux", measure_gateway_mux},
      {"hosts-delivery", measure_hosts_delivery},
      {"hosts-losers", measure_hosts_losers},
      {"hosts-scale", measure_hosts_scale},
  };
}

}  // namespace arbiter::bench
