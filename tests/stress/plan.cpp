#include "tests/stress/plan.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "shm/limits.hpp"

namespace arbiter::stress {
namespace {

SourcePlan make_source(const Options& options, Random& random) {
  SourcePlan source;
  const std::int64_t timeouts[] = {0, 0, 20'000, 200'000, 2'000'000};
  source.timeout_ns = timeouts[random.below(5)];
  source.burst = 1 + random.below(40);
  source.pause_us = 1 + random.below(200);
  // The records have room for so many arrivals only.
  if (options.stop_seconds != 0) {
    source.pause_us = 1000 + static_cast<std::uint32_t>(options.stop_seconds * 500);
  }
  source.max_loans = 1 + random.below(2);
  return source;
}

PortPlan make_port(Random& random, bool waits) {
  PortPlan port;
  port.depth = 1 + random.below(4);
  port.max_held = 1 + random.below(2);
  port.refuse_new = random.one_in(4);
  port.keep = random.one_in(6);
  port.waits = waits;
  return port;
}

// The connected sources in an order of their own at each port: each is inhibited by all before it,
// so that no two can win. A further literal or two, on any source, makes the rule stricter.
std::vector<RulePlan> make_rules(const std::vector<RulePlan>& connected, Random& random) {
  std::vector<RulePlan> rules = connected;
  std::vector<std::uint32_t> order(rules.size());
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t i = order.size(); i > 1; --i) {
    std::swap(order[i - 1], order[random.below(static_cast<std::uint32_t>(i))]);
  }
  SourceSet before = 0;
  for (const std::uint32_t source : order) {
    if (!rules[source].connected) continue;
    rules[source].need_inactive = before;
    before |= bit(source);
    const auto other = random.below(static_cast<std::uint32_t>(rules.size()));
    if (!random.one_in(4) || other == source) continue;
    if (random.one_in(3)) {
      if ((rules[source].need_inactive & bit(other)) == 0) rules[source].need_active |= bit(other);
    } else {
      rules[source].need_inactive |= bit(other);
    }
  }
  return rules;
}

// What slot_pool.hpp says a port needs, or so much less that the queue that comes last is cut
// short; and more where receivers come anew before those that died are forgotten.
std::uint64_t memory_for(const Plan& plan, std::uint32_t source, bool kills, Random& random) {
  const std::uint64_t stride = (kMaxSample + 63) / 64 * 64;
  std::uint64_t slots = plan.sources[source].max_loans + 1;
  std::uint32_t smallest = shm::kMaxDepth;
  for (const PortPlan& port : plan.ports) {
    slots += port.max_held + port.depth;
    smallest = std::min(smallest, port.depth);
  }
  slots -= random.below(smallest);
  return stride * slots * (kills ? 8 : 1);
}

}  // namespace

Plan make_plan(const Options& options, std::uint64_t seed) {
  Random random(seed);
  Plan plan;
  plan.seed = seed;
  const std::uint32_t publishers =
      options.publishers != 0 ? options.publishers : 1 + random.below(8);
  const std::uint32_t receivers = options.receivers != 0 ? options.receivers : 1 + random.below(8);
  const std::uint32_t relays = options.kills + options.stops != 0 ? 1 : random.below(3);
  for (std::uint32_t i = 0; i < receivers + relays; ++i) {
    plan.ports.push_back(make_port(random, i < receivers && random.one_in(3)));
  }
  for (std::uint32_t i = 0; i < publishers + relays; ++i) {
    plan.sources.push_back(make_source(options, random));
  }
  for (std::uint32_t i = 0; i < receivers; ++i) plan.components.push_back({.port = i});
  for (std::uint32_t i = 0; i < publishers; ++i) plan.components.push_back({.source = i});
  for (std::uint32_t i = 0; i < relays; ++i) {
    plan.components.push_back({.source = publishers + i, .port = receivers + i});
  }
  for (std::uint32_t i = 0, taps = random.below(kMaxTaps + 1); i < taps; ++i) {
    plan.components.push_back({.watches = random.below(publishers + relays), .log = i});
  }
  for (auto& model : plan.rules) model.resize(plan.ports.size());
  for (std::uint32_t port = 0; port < plan.ports.size(); ++port) {
    std::vector<RulePlan> connected(plan.sources.size());
    for (std::uint32_t source = 0; source < plan.sources.size(); ++source) {
      const bool in_a_circle = port >= receivers && source >= publishers;
      connected[source].connected = !in_a_circle && !random.one_in(5);
    }
    connected[random.below(publishers)].connected = true;
    for (auto& model : plan.rules) model[port] = make_rules(connected, random);
  }
  for (std::uint32_t source = 0; source < plan.sources.size(); ++source) {
    plan.sources[source].max_memory =
        memory_for(plan, source, options.kills + options.daemon_kills != 0, random);
  }
  return plan;
}

std::string Plan::model_text(std::uint32_t model) const {
  std::string text = "<behaviors timeout=\"forever\">";
  for (std::uint32_t source = 0; source < sources.size(); ++source) {
    const std::int64_t timeout = sources[source].timeout_ns;
    text += "<source port=\"" + source_name(source) + "\" timeout=\"" +
            (timeout == 0 ? "forever" : std::to_string(timeout) + "ns") + "\"/>";
  }
  for (std::uint32_t port = 0; port < ports.size(); ++port) {
    text += "<arbiter at=\"" + port_name(port) + "\">";
    for (std::uint32_t source = 0; source < sources.size(); ++source) {
      const RulePlan& rule = rules[model][port][source];
      if (!rule.connected) continue;
      text += "<select from=\"" + source_name(source) + "\">true";
      for (std::uint32_t other = 0; other < sources.size(); ++other) {
        if ((rule.need_active & bit(other)) != 0) text += " and " + source_name(other);
        if ((rule.need_inactive & bit(other)) != 0) text += " and not " + source_name(other);
      }
      text += "</select>";
    }
    text += "</arbiter>";
  }
  return text + "</behaviors>";
}

}  // namespace arbiter::stress
