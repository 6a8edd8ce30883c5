#include "watch/slow_publishers.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "shm/clock.hpp"
#include "watch/doctor.hpp"
#include "watch/instance.hpp"
#include "watch/pace.hpp"
#include "watch/picture.hpp"
#include "watch/span.hpp"

namespace arbiter::watch {
namespace {

// Long enough for the last arrival before it and two more, a second apart.
constexpr shm::Nanoseconds kLongestLook = 2'500'000'000;

// A single question does not wait longer for an arrival that may never come.
constexpr shm::Nanoseconds kLongestGap = 1'000'000'000;

void sleep_for_a_look() { std::this_thread::sleep_for(std::chrono::nanoseconds(kPaceLook)); }

// Until when to wait for the next arrival; nothing: do not wait.
std::optional<shm::Nanoseconds> waits_until(const SourceState& state, shm::Nanoseconds now,
                                            const wire::SourceStatus* source) {
  const bool has_expired = shm::is_finite(state.word) && state.word != shm::kNeverActive &&
                           !shm::is_active(state.word, now);
  if (!has_expired || state.timeout < kLeastPacedTimeout) return std::nullopt;
  const auto last = state.last_arrival();
  if (!last || *last + kLongestGap <= now) return std::nullopt;
  if (source == nullptr || !source->open) return std::nullopt;
  return *last + kLongestGap;
}

// Those that a rule selects or reads: of others it does not matter when they are active.
std::set<std::string> sources_of_rules(const wire::Status& status) {
  std::set<std::string> sources;
  for (const wire::InputStatus& port : status.inputs) {
    if (!port.arbitrated) continue;
    for (const auto& connection : port.connections) sources.insert(connection.source);
    for (const auto& sensed : port.senses) sources.insert(sensed.source);
  }
  return sources;
}

bool may_be_slow(const wire::SourceStatus& source) {
  return source.open && source.timeout != shm::kForever && source.timeout >= kLeastPacedTimeout;
}

std::vector<const wire::SourceStatus*> sources_that_may_be_slow(const wire::Status& status) {
  const std::set<std::string> matter = sources_of_rules(status);
  std::vector<const wire::SourceStatus*> result;
  for (const wire::SourceStatus& each : status.sources) {
    if (may_be_slow(each) && matter.contains(each.name)) result.push_back(&each);
  }
  return result;
}

// The sources' paces, once all are known or the time is over.
std::map<shm::SourceId, Pace> watch_paces(Instance& instance,
                                          const std::vector<shm::SourceId>& sources,
                                          const std::function<void()>& while_looking) {
  std::map<shm::SourceId, Pace> paces;
  for (const shm::SourceId source : sources) paces[source];
  const shm::Nanoseconds end = shm::monotonic_now() + kLongestLook;
  for (;;) {
    const Picture picture =
        take_picture(*instance.memory(), [&](const shm::TableView&) { return sources; });
    for (auto& [source, pace] : paces) {
      const auto word = picture.words.find(source);
      if (word == picture.words.end()) continue;
      pace.look(word->second, picture.snapshot.table.timeout(source), picture.now);
    }
    const bool are_known = std::all_of(paces.begin(), paces.end(),
                                       [](const auto& each) { return each.second.is_known(); });
    if (are_known || picture.now >= end) return paces;
    while_looking();
    sleep_for_a_look();
  }
}

// Two periods, to two digits.
std::string longer_timeout(shm::Nanoseconds period) {
  shm::Nanoseconds unit = 1'000'000;
  while (2 * period >= 100 * unit) unit *= 10;
  return std::to_string((2 * period + unit - 1) / unit * unit / 1'000'000) + "ms";
}

Finding slowness(const wire::SourceStatus& source, shm::Nanoseconds period,
                 shm::Nanoseconds timeout) {
  const wire::Component& component = source.open->component;
  return {
      "slow-publisher",
      slow_text(source.name, period, timeout) + " (" + component.node + ", pid " +
          std::to_string(component.pid) + ")",
      "whenever its T has passed, the next in command takes over, or the port is idle, until the "
      "source arrives again",
      "publish at least twice within T, or give the source a longer T in the model: <source "
      "port=\"" +
          source.name + "\" timeout=\"" + longer_timeout(period) + "\"/>"};
}

}  // namespace

void add_gaps(const Port& port, Look& look, const wire::Status& status) {
  std::map<shm::SourceId, shm::Nanoseconds> waiting;  // until when
  for (const auto& [source, word] : look.picture.words) {
    const std::string& name = port.source_name(source);
    const auto until =
        waits_until(look.sources.state(name), look.sources.now(), status.find_source(name));
    if (until) waiting.emplace(source, *until);
  }
  while (!waiting.empty()) {
    sleep_for_a_look();
    const Look later = port.look();
    if (later.generation() != look.generation()) return;
    std::erase_if(waiting, [&](const auto& each) {
      const auto& [source, until] = each;
      const shm::ActivityWord word = later.picture.words.at(source);
      SourceState state = look.sources.state(port.source_name(source));
      if (word == state.word) return later.picture.now >= until;
      if (shm::is_finite(word)) {
        state.gap = word - state.word;
        look.sources.set(port.source_name(source), state);
      }
      return true;
    });
  }
}

Findings examine_publishers(const wire::Caller& caller, const wire::Status& status,
                            const std::function<void()>& while_looking) {
  Findings found;
  const auto candidates = sources_that_may_be_slow(status);
  if (candidates.empty()) return found;
  try {
    Instance instance(caller);
    instance.catch_up();
    std::map<shm::SourceId, const wire::SourceStatus*> known;
    std::vector<shm::SourceId> sources;
    for (const wire::SourceStatus* const each : candidates) {
      const auto id = instance.find_source(each->name);
      if (id && known.emplace(*id, each).second) sources.push_back(*id);
    }
    std::sort(sources.begin(), sources.end());
    for (const auto& [source, pace] : watch_paces(instance, sources, while_looking)) {
      const auto period = pace.slow_period();
      if (period) found.push_back(slowness(*known.at(source), *period, known.at(source)->timeout));
    }
  } catch (const wire::CallError&) {
    // Other checks report what is wrong with the daemon.
  }
  return found;
}

}  // namespace arbiter::watch
