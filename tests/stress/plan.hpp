// What one round consists of: components, ports with tiny queues, and two models that take turns.
// All of it follows from the seed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/stress/options.hpp"
#include "tests/stress/sample.hpp"

namespace arbiter::stress {

inline constexpr std::uint32_t kMaxComponents = 20;
inline constexpr std::uint32_t kMaxSources = 10;  // 8 publishers, 2 relays
inline constexpr std::uint32_t kMaxPorts = 10;
inline constexpr std::uint32_t kMaxTaps = 2;
inline constexpr std::uint32_t kModels = 2;
inline constexpr std::uint32_t kNobody = 0xffffffff;

using SourceSet = std::uint32_t;  // a bit for each source
constexpr SourceSet bit(std::uint32_t source) noexcept { return SourceSet{1} << source; }

struct SourcePlan {
  std::int64_t timeout_ns = 0;  // 0: forever
  std::uint32_t burst = 20;     // arrivals before it falls silent, at most
  std::uint32_t pause_us = 50;  // for so long, at most
  std::uint32_t max_loans = 1;
  std::uint64_t max_memory = 0;
};

struct PortPlan {
  std::uint32_t depth = 1;
  std::uint32_t max_held = 1;
  bool refuse_new = false;
  bool keep = false;
  bool waits = false;  // sleeps in wait_for() where nothing waits
};

// A connection's rule: a conjunction of literals.
struct RulePlan {
  bool connected = false;
  SourceSet need_active = 0;
  SourceSet need_inactive = 0;
};

// A component has an input port, an output port, or both: then it is a relay, as a gateway is. Or
// it has a tap.
struct ComponentPlan {
  std::uint32_t source = kNobody;
  std::uint32_t port = kNobody;
  std::uint32_t watches = kNobody;  // a source
  std::uint32_t log = 0;            // of taps
};

struct Plan {
  std::uint64_t seed = 0;
  std::vector<SourcePlan> sources;
  std::vector<PortPlan> ports;
  std::vector<ComponentPlan> components;
  std::vector<std::vector<RulePlan>> rules[kModels];  // [model][port][source]

  [[nodiscard]] std::string model_text(std::uint32_t model) const;
};

Plan make_plan(const Options& options, std::uint64_t seed);

inline std::string source_name(std::uint32_t source) { return "/source" + std::to_string(source); }
inline std::string port_name(std::uint32_t port) { return "/port" + std::to_string(port); }

}  // namespace arbiter::stress
