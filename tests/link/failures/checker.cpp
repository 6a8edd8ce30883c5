#include "tests/link/failures/checker.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

namespace arbiter::failures {
namespace {

using Kind = Happened::Kind;
using Pair = std::pair<std::uint32_t, std::uint64_t>;

// A publisher that was started again has published no more by the time at which it is heard of.
constexpr std::uint64_t kFirstOfALife = 1000;
// A recorder that begins again with a new daemon may not have all that happened around that.
constexpr Nanoseconds kBegins = 2 * kSecond;
// Of a publisher that pauses.
constexpr Nanoseconds kSilence = 100 * kMs;

const std::vector<Happened>& of(const HostEvidence& host, const std::string& source) {
  static const std::vector<Happened> kNone;
  const auto found = host.sources.find(source);
  return found == host.sources.end() ? kNone : found->second;
}

std::string ms(Nanoseconds time) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f ms", static_cast<double>(time) / 1e6);
  return text;
}

bool is_arrival(const Happened& event) {
  return event.kind == Kind::sample || event.kind == Kind::signal;
}

// What was withheld may follow its signal, once.
bool is_completed_by(const Happened& before, const Happened& event) {
  return before.kind == Kind::signal && event.kind == Kind::sample &&
         before.exporter == event.exporter && before.sequence == event.sequence;
}

// Of the publisher. A signal does not say.
bool is_other_life(const Happened& before, const Happened& event) {
  if (before.command && event.command) return before.command->life != event.command->life;
  return event.sequence < before.sequence && event.sequence <= kFirstOfALife;
}

std::string number_of(const Happened& event) {
  if (!event.command) return "number " + std::to_string(event.sequence);
  return std::to_string(event.command->life) + "." + std::to_string(event.command->number);
}

// When a source is surely active: from when an arrival was seen to its end.
struct Active {
  Nanoseconds from = 0;
  Nanoseconds to = 0;
};

std::vector<Active> surely_active(const HostEvidence& host, const std::string& source,
                                  Nanoseconds timeout) {
  std::vector<Active> result;
  for (const Happened& event : of(host, source)) {
    // Until here: from its time on it may have been different.
    if (event.kind == Kind::deactivation || event.kind == Kind::gap) {
      if (!result.empty()) result.back().to = std::min(result.back().to, event.time);
      continue;
    }
    Nanoseconds to = event.time + timeout;
    for (const Nanoseconds beginning : host.beginnings) {
      if (event.time < beginning) to = std::min(to, beginning);
    }
    if (!result.empty() && event.seen <= result.back().to) {
      result.back().to = std::max(result.back().to, to);
    } else {
      result.push_back({event.seen, to});
    }
  }
  return result;
}

constexpr Nanoseconds kEnd = 1'000'000'000 * kSecond;

// From each arrival to the last moment at which it may count, or the end that was told.
std::vector<Active> possibly_active(const std::vector<Happened>& events, Nanoseconds timeout) {
  std::vector<Active> result;
  for (const Happened& event : events) {
    if (event.kind == Kind::deactivation) {
      if (!result.empty()) result.back().to = std::min(result.back().to, event.seen);
    } else if (result.empty() || event.time > result.back().to) {
      result.push_back({event.time, event.seen + timeout});
    } else {
      result.back().to = std::max(result.back().to, event.seen + timeout);
    }
  }
  return result;
}

bool overlaps(const std::vector<Span>& spans, Nanoseconds from, Nanoseconds to) {
  return std::any_of(spans.begin(), spans.end(),
                     [&](const Span& span) { return span.from <= to && from <= span.to; });
}

}  // namespace

void check_decisions(const HostEvidence& host, Findings& found, Checked& checked) {
  checked.decisions += host.decisions;
  checked.uncertain += host.uncertain;
  for (const std::string& each : host.wrong) found.push_back(host.name + ": " + each);
}

void check_winners(const HostEvidence& host, const std::string& model,
                   const std::map<std::string, Ranked>& ranks, Findings& found, Checked& checked) {
  for (const auto& [first, its] : ranks) {
    const std::vector<Active> active = surely_active(host, first, its.timeout);
    for (const auto& [second, other] : ranks) {
      if (other.rank <= its.rank) continue;
      auto span = active.begin();
      for (const Happened& event : of(host, second)) {
        if (!event.won) continue;
        while (span != active.end() && span->to < event.seen) ++span;
        const bool is_of_it = model.empty() || had_model(host, model, event.time, event.seen);
        checked.pairs += is_of_it ? 1 : 0;
        if (!is_of_it || span == active.end() || span->from > event.time) continue;
        found.push_back(host.name + ": " + second + " commands at " + ms(event.time) + " though " +
                        first + " is active from " + ms(span->from) + " to " + ms(span->to));
      }
    }
  }
}

void check_age(const HostEvidence& importer, const HostEvidence& exporter,
               const std::string& source, const MostAge& most_at, Findings& found,
               Checked& checked) {
  // A successor of the publisher counts from 1 again.
  std::map<std::uint64_t, std::vector<Nanoseconds>> published;
  for (const Happened& event : of(exporter, source)) {
    if (is_arrival(event)) published[event.sequence].push_back(event.time);
  }
  for (const Happened& event : of(importer, source)) {
    if (!is_arrival(event)) continue;
    ++checked.arrivals;
    const Nanoseconds most = most_at(event.time);
    const Nanoseconds least = event.command ? event.command->made : 0;
    if (event.command && 2 * (event.time - least) > most) ++checked.old;
    if (event.command && event.time - least <= most) continue;  // it was published after that
    Nanoseconds latest = 0;
    for (const Nanoseconds time : published[event.sequence]) {
      if (time <= event.time && time >= least) latest = std::max(latest, time);
    }
    const bool may_be_later = !event.command && began_between(exporter, latest, event.time);
    if (latest == 0 || may_be_later) {
      ++checked.unsure;
    } else if (event.time - latest > most) {
      found.push_back(importer.name + ": " + source + " " + number_of(event) +
                      " arrived when it was " + ms(event.time - latest) +
                      " old, which is more than " + ms(most));
    }
  }
}

void check_order(const HostEvidence& importer, const std::string& source, Findings& found) {
  Pair last{};
  std::map<std::uint64_t, const Happened*> before;  // by exporter
  for (const Happened& event : of(importer, source)) {
    if (!is_arrival(event)) continue;
    const Happened*& its = before[event.exporter];
    const bool completes = its != nullptr && event.exporter != 0 && is_completed_by(*its, event);
    if (event.command && !completes) {
      const Pair current{event.command->life, event.command->number};
      if (current <= last) {
        found.push_back(importer.name + ": " + source + " " + number_of(event) + " arrived after " +
                        std::to_string(last.first) + "." + std::to_string(last.second));
      }
      last = std::max(last, current);
    }
    const bool follows = its == nullptr || event.exporter == 0 || completes ||
                         event.sequence > its->sequence || is_other_life(*its, event);
    if (!follows) {
      found.push_back(importer.name + ": " + source + " number " + std::to_string(event.sequence) +
                      " arrived after number " + std::to_string(its->sequence));
    }
    its = &event;
  }
}

void check_ends(const HostEvidence& importer, const HostEvidence& exporter,
                const std::string& source, Findings& found, Checked& checked) {
  std::vector<Nanoseconds> ends;
  std::vector<Span> unknown;
  for (const Happened& event : of(exporter, source)) {
    if (event.kind == Kind::deactivation) ends.push_back(event.time);
    if (event.kind == Kind::gap) unknown.push_back({event.time, event.seen});
  }
  for (const Nanoseconds each : exporter.beginnings) {
    unknown.push_back({each - kBegins, each + kBegins});
  }
  std::sort(ends.begin(), ends.end());  // what a recorder finds when it joins may be older
  const Happened* before = nullptr;
  const Happened* end = nullptr;
  for (const Happened& event : of(importer, source)) {
    if (event.kind == Kind::deactivation && !event.is_state && end == nullptr) end = &event;
    if (!event.command) continue;
    const bool is_told = end != nullptr && before != nullptr && !is_other_life(*before, event) &&
                         !overlaps(unknown, before->command->made, event.command->made);
    if (is_told) {
      ++checked.ends;
      const auto its = std::upper_bound(ends.begin(), ends.end(), before->command->made);
      if (its == ends.end() || *its > event.command->made) {
        found.push_back(importer.name + ": " + source + " was deactivated at " + ms(end->time) +
                        ", between " + number_of(*before) + " and " + number_of(event) +
                        ", but not so at its exporter");
      }
    }
    before = &event;
    end = nullptr;
  }
}

std::vector<Asked> asked_for(const HostEvidence& importer, const std::string& source) {
  std::vector<Asked> result;
  const auto& events = of(importer, source);
  for (auto each = events.begin(); each != events.end(); ++each) {
    if (each->kind != Kind::signal || !each->won || each->exporter == 0) continue;
    const auto next = std::next(each);
    if (next == events.end()) break;
    result.push_back({each->time, is_completed_by(*each, *next)});
  }
  return result;
}

std::vector<End> ends_of(const HostEvidence& exporter, const std::string& source) {
  std::vector<End> result;
  const auto& events = of(exporter, source);
  for (auto each = events.begin(); each != events.end(); ++each) {
    if (each->kind != Kind::deactivation || each->is_state) continue;
    const auto next = std::find_if(std::next(each), events.end(),
                                   [](const Happened& event) { return !event.is_state; });
    if (next != events.end() && next->kind == Kind::gap) continue;  // what followed is not known
    result.push_back({each->time, next == events.end() ? kEnd : next->time});
  }
  return result;
}

Recovery first_end_after(const HostEvidence& importer, const std::string& source, Nanoseconds time,
                         bool or_newer) {
  for (const Happened& event : of(importer, source)) {
    const bool is_newer = is_arrival(event) && event.command && event.command->made >= time;
    if (event.time < time || (!is_newer && event.kind != Kind::deactivation)) continue;
    if (is_newer && !or_newer) return {};
    return {true, event.time - time};
  }
  return {};
}

void check_losses(const HostEvidence& importer, const std::string& source, std::uint64_t counted,
                  const std::vector<Span>& spans, Findings& found, Checked& checked) {
  std::uint64_t missing = 0;
  const Happened* before = nullptr;
  bool is_whole = true;  // the recording, since `before`
  for (const Happened& event : of(importer, source)) {
    is_whole = is_whole && event.kind != Kind::gap;
    if (!is_arrival(event)) continue;
    if (before != nullptr && is_whole && before->exporter == event.exporter &&
        !is_other_life(*before, event) && event.sequence > before->sequence &&
        !overlaps(spans, before->time, event.time)) {
      missing += event.sequence - before->sequence - 1;
    }
    before = &event;
    is_whole = true;
  }
  checked.missing += missing;
  checked.counted += counted;
  if (missing <= counted) return;
  found.push_back(importer.name + ": of " + source + " " + std::to_string(missing) +
                  " samples are missing, but only " + std::to_string(counted) + " are counted");
}

void check_counts(const HostEvidence& importer, const HostEvidence& exporter,
                  const std::string& source, std::uint64_t counted, std::uint64_t joins,
                  Nanoseconds since, Findings& found) {
  // A recorder joins later than a publisher begins, but samples are numbered. A deactivation that
  // does not come is counted, too, and what a recorder did not see.
  std::uint64_t published = 0;
  std::map<std::uint32_t, Pair> lives;  // the last before `since`, the last
  for (const Happened& event : of(exporter, source)) {
    if (event.command) {
      Pair& last = lives[event.command->life];
      last.second = event.command->number;
      if (event.time < since) last.first = static_cast<std::uint32_t>(last.second);
    } else if (event.time >= since) {
      published += event.kind == Kind::gap ? event.events : 1;
    }
  }
  for (const auto& [life, last] : lives) published += last.second - last.first;
  // The sample of a signal that wins is asked for, and may be counted as late.
  const auto& events = of(importer, source);
  const auto arrived = static_cast<std::uint64_t>(
      std::count_if(events.begin(), events.end(), [&](const Happened& event) {
        const bool is_one =
            event.kind == Kind::sample || (event.kind == Kind::signal && !event.won);
        return is_one && event.command && event.command->made >= since;
      }));
  if (counted + arrived <= published + joins) return;
  found.push_back(importer.name + ": of " + source + " " + std::to_string(published) +
                  " events were published and " + std::to_string(arrived) + " arrived, but " +
                  std::to_string(counted) + " are counted as missing");
}

void check_cuts(const HostEvidence& importer, const std::string& source,
                const std::vector<Span>& cuts, Findings& found) {
  for (const Happened& event : of(importer, source)) {
    if (!event.command) continue;
    for (const Span& cut : cuts) {
      if (event.command->made <= cut.from || event.time >= cut.to) continue;
      found.push_back(importer.name + ": " + source + " " + number_of(event) +
                      " came through a cut");
    }
  }
}

Recovery closed_after(const HostEvidence& importer, const std::string& source, Nanoseconds time) {
  const auto its = importer.closures.find(source);
  if (its == importer.closures.end()) return {};
  const auto first = std::find_if(its->second.begin(), its->second.end(),
                                  [&](Nanoseconds each) { return each >= time; });
  return first == its->second.end() ? Recovery{} : Recovery{true, *first - time};
}

bool was_there(const HostEvidence& importer, const std::string& source, Nanoseconds time) {
  const auto& events = of(importer, source);
  return std::any_of(events.begin(), events.end(), [&](const Happened& event) {
    return is_arrival(event) && event.time <= time && event.time > time - 100 * kMs;
  });
}

Recovery first_arrival_after(const HostEvidence& host, const std::string& source,
                             Nanoseconds time) {
  for (const Happened& event : of(host, source)) {
    if (event.time >= time && is_arrival(event)) return {true, event.time - time};
  }
  return {};
}

Recovery recovery_after(const HostEvidence& importer, const HostEvidence& exporter,
                        const std::string& source, Nanoseconds time) {
  const auto& arrivals = of(importer, source);
  const auto arrival = std::find_if(arrivals.begin(), arrivals.end(), [&](const Happened& event) {
    return event.time >= time && is_arrival(event);
  });
  if (arrival == arrivals.end()) return {};
  // Of a signal: the latest with its number.
  const auto& published = of(exporter, source);
  const auto its = std::find_if(published.rbegin(), published.rend(), [&](const Happened& event) {
    return is_arrival(event) && event.sequence == arrival->sequence && event.time <= arrival->time;
  });
  if (!arrival->command && its == published.rend()) return {true, arrival->time - time};
  const Nanoseconds made = arrival->command ? arrival->command->made : its->time;
  Nanoseconds first = made;
  Nanoseconds last = made;
  for (const Happened& event : published) {
    if (event.time < time || event.time >= made) continue;
    first = std::min(first, event.time);
    last = event.time;
  }
  const Nanoseconds silent = made - last > kSilence ? made - last : 0;
  return {true, std::max<Nanoseconds>(arrival->time - first - silent, 0)};
}

std::vector<Fallback> fallbacks(const HostEvidence& host,
                                const std::map<std::string, Ranked>& ranks, const std::string& last,
                                Nanoseconds least) {
  std::vector<Active> active;
  for (const auto& [source, its] : ranks) {
    if (its.rank >= ranks.at(last).rank) continue;
    for (const Active& each : possibly_active(of(host, source), its.timeout)) {
      active.push_back(each);
    }
  }
  std::sort(active.begin(), active.end(),
            [](const Active& a, const Active& b) { return a.from < b.from; });
  std::vector<Fallback> result;
  Nanoseconds until = 0;
  const auto& events = of(host, last);
  for (std::size_t i = 0; i <= active.size(); ++i) {
    const Nanoseconds next = i < active.size() ? active[i].from : kEnd;
    if (until != 0 && next > until + least) {
      const auto first = std::find_if(events.begin(), events.end(), [&](const Happened& event) {
        return event.won && event.time > until;
      });
      if (first != events.end() && first->time < next) {
        result.push_back({until, {true, first->time - until}});
      } else if (next != kEnd) {
        result.push_back({until, {}});
      }
    }
    if (i < active.size()) until = std::max(until, active[i].to);
  }
  return result;
}

}  // namespace arbiter::failures
