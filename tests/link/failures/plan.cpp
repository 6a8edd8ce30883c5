#include "tests/link/failures/plan.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "tests/link/failures/command.hpp"

namespace arbiter::failures {
namespace {

constexpr Nanoseconds kBeginning = kSecond;        // without trouble
constexpr Nanoseconds kAfterwards = 12 * kSecond;  // likewise

Nanoseconds timeout(stress::Random& random) {
  constexpr std::array<Nanoseconds, 5> kTimeouts{120 * kMs, 200 * kMs, 300 * kMs, 500 * kMs,
                                                 kForever};
  return kTimeouts[random.below(kTimeouts.size())];
}

// Large samples lose where a small source is first, and cross where T is forever.
void have_losers(HostPlan& plan) {
  const auto is_small = [](unsigned host) { return !is_large(host); };
  for (std::vector<unsigned>& order : plan.orders) {
    std::iter_swap(order.begin(), std::find_if(order.begin(), order.end() - 1, is_small));
  }
  for (std::vector<Nanoseconds>& timeouts : plan.timeouts) {
    for (unsigned other = 1; other <= timeouts.size(); ++other) {
      Nanoseconds& its = timeouts[other - 1];
      if (is_large(other) && its == kForever) its = kModelTimeout;
    }
  }
}

// Mostly short, for then there are many; now and then longer than the lease, and much longer.
Nanoseconds duration(const Options& options, stress::Random& random) {
  const std::uint32_t which = random.below(20);
  if (which < 8) return (50 + random.below(950)) * kMs;
  if (which < 14 || options.is_short) return kSecond + random.below(1500) * kMs;
  if (which < 19) return 10 * kSecond;
  return 60 * kSecond;
}

Trouble draw_trouble(const Options& options, stress::Random& random) {
  for (;;) {
    const auto trouble = static_cast<Trouble>(random.below(kTroubles));
    if (options.only.empty() || options.only.count(name_of(trouble)) != 0) return trouble;
  }
}

Event draw(const Options& options, unsigned hosts, stress::Random& random) {
  Event event;
  event.trouble = draw_trouble(options, random);
  event.host = 1 + random.below(hosts);
  event.other = 1 + (event.host + random.below(hosts - 1)) % hosts;
  event.model = event.trouble == Trouble::switch_cannot ? 2 : random.below(2);
  event.is_abrupt = random.one_in(2);
  if (event.trouble == Trouble::split && event.host == hosts) --event.host;
  event.lasts = duration(options, random);
  event.fault.lost = random.below(300);
  event.fault.doubled = random.below(300);
  event.fault.delayed = random.below(300);
  event.fault.delay = (1 + random.below(400)) * kMs;
  if (event.trouble == Trouble::slow) {
    const Nanoseconds delay = event.fault.delay;
    event.fault = {};
    event.fault.delayed = 1000;
    event.fault.delay = delay / 2;  // in each direction
    event.fault.is_even = true;
  }
  return event;
}

std::string text_of(Nanoseconds time) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f s", static_cast<double>(time) / 1e9);
  return text;
}

std::string timeout_text(Nanoseconds timeout) {
  return timeout == kForever ? "forever" : std::to_string(timeout / kMs) + "ms";
}

}  // namespace

const char* name_of(Trouble trouble) noexcept {
  constexpr std::array<const char*, kTroubles> kNames{"cable cut",
                                                      "heard by nobody",
                                                      "hears nobody",
                                                      "network split",
                                                      "noise",
                                                      "noise at all",
                                                      "slow network",
                                                      "interface down",
                                                      "host stopped",
                                                      "link stopped",
                                                      "link killed",
                                                      "daemon killed",
                                                      "component killed",
                                                      "host killed",
                                                      "link killed in a switch",
                                                      "rival",
                                                      "switch of all",
                                                      "switch that one host cannot",
                                                      "two switches at once"};
  return kNames[static_cast<std::size_t>(trouble)];
}

std::string Plan::model_text(unsigned host, unsigned model) const {
  const HostPlan& plan = hosts[host - 1];
  const std::string at = R"(<config at=")" + motor_of(host) + "\">";
  std::string text = "<behaviors timeout='" + timeout_text(kModelTimeout) + "'>\n";
  for (unsigned other = 1; other <= hosts.size(); ++other) {
    text += "<source port='" + source_of(other) + "' timeout='" +
            timeout_text(plan.timeouts[model][other - 1]) + "'/>\n";
  }
  std::string lower = "Hold, Shared";
  text += "<behavior name='Hold'>" + at + hold_of(host) + "</config></behavior>\n";
  text += "<behavior name='Shared'>" + at + kShared +
          "</config><inhibition>Hold</inhibition></behavior>\n";
  const std::vector<unsigned>& order = plan.orders[model];
  for (auto each = order.rbegin(); each != order.rend(); ++each) {
    const std::string name = "Obey " + std::to_string(*each);
    text += "<behavior name='" + name + "'>" + at + source_of(*each) + "</config><inhibition>" +
            lower + "</inhibition></behavior>\n";
    lower += ", " + name;
  }
  return text + "</behaviors>\n";
}

std::string Plan::text() const {
  std::string text = std::to_string(hosts.size()) + " hosts, " + text_of(lasts);
  if (has_losers) text += "; large samples that lose stay at home";
  if (late_host != 0) {
    text += "; the interface of host" + std::to_string(late_host) + " comes after its link";
  }
  text += '\n';
  for (const Event& event : events) {
    text += "  " + text_of(event.at) + ": host" + std::to_string(event.host) + ", " +
            name_of(event.trouble) + " for " + text_of(event.lasts) + '\n';
  }
  return text;
}

Plan make_plan(const Options& options, std::uint64_t seed) {
  stress::Random random(seed);
  Plan plan;
  plan.seed = seed;
  plan.period = kSecond / options.rate;
  const unsigned hosts = options.hosts != 0 ? options.hosts : 3 + random.below(3);
  plan.has_losers = random.one_in(2);
  for (unsigned host = 1; host <= hosts; ++host) {
    HostPlan one;
    for (std::vector<Nanoseconds>& timeouts : one.timeouts) {
      for (unsigned other = 1; other <= hosts; ++other) timeouts.push_back(timeout(random));
    }
    // Its own source last: it would hide what the others do.
    for (unsigned i = 0; i < hosts; ++i) one.orders[0].push_back((host + i) % hosts + 1);
    std::swap(one.orders[0][0], one.orders[0][random.below(hosts - 1)]);
    one.orders[1] = one.orders[0];
    std::reverse(one.orders[1].begin(), one.orders[1].end() - 1);
    one.orders[2] = one.orders[0];
    if (plan.has_losers) have_losers(one);
    plan.hosts.push_back(std::move(one));
  }
  if (random.one_in(3)) plan.late_host = 1 + random.below(hosts);
  plan.host_without = 1 + random.below(hosts);
  plan.speakers = {1 + random.below(hosts), 1 + random.below(hosts)};
  const double most = options.is_short ? options.seconds : std::min(options.seconds, 90.0);
  const auto until = static_cast<Nanoseconds>(most * 1e9);
  for (Nanoseconds at = kBeginning; at < until;) {
    Event event = draw(options, hosts, random);
    event.at = at;
    // In a short round nothing lasts on behind its end.
    if (options.is_short) event.lasts = std::min(event.lasts, until - at);
    plan.events.push_back(event);
    at += (200 + random.below(2000)) * kMs;
  }
  plan.lasts = until;
  for (const Event& event : plan.events) plan.lasts = std::max(plan.lasts, event.at + event.lasts);
  plan.lasts += options.is_short ? kAfterwards / 2 : kAfterwards;
  return plan;
}

}  // namespace arbiter::failures
