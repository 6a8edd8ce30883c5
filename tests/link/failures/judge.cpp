#include "tests/link/failures/judge.hpp"

#include <algorithm>
#include <cstdio>

#include "tests/link/failures/speakers.hpp"
#include "tests/link/failures/switches.hpp"

namespace arbiter::failures {
namespace {

// What the page promises of a healthy network.
constexpr Nanoseconds kPromised = kSecond;
// The next in command publishes every period; this is for its process, beside what it waited.
constexpr Nanoseconds kNextCommand = 100 * kMs;
// Each trouble of the two may make an exporter join a source again: what it says then, and what its
// tap does.
constexpr std::uint64_t kStatesOfAJoin = 2;
// A time in which nothing else may be active, and is looked at.
constexpr Nanoseconds kIdle = 300 * kMs;
// In a second: whose processes waited for a processor for longer than that was starved.
constexpr Nanoseconds kStarved = 500 * kMs;
// The end of a trouble is noted a little after it.
constexpr Nanoseconds kSettling = 20 * kMs;
// What a link's earlier life has sent may come so long after the next one has begun: no sample
// arrives that is older than its T.
constexpr Nanoseconds kAfterRestart = kSecond;

// Processes that have begun anew know each other by then.
constexpr Nanoseconds kNotTroubled = 3 * kSecond;

// A link asks its daemon ten times a second which model is in force, and waits up to a second for
// its answer.
constexpr Nanoseconds kKnowsItsModel = 1500 * kMs;

// The shortest and the longest of all models.
std::pair<Nanoseconds, Nanoseconds> timeouts_of(const HostPlan& plan, unsigned other) {
  std::pair<Nanoseconds, Nanoseconds> result{kLong, 0};
  for (const auto& timeouts : plan.timeouts) {
    const Nanoseconds its = timeouts[other - 1] == kForever ? kLong : timeouts[other - 1];
    result = {std::min(result.first, its), std::max(result.second, its)};
  }
  return result;
}

bool is_over(const Span& span) { return span.to < now(); }

}  // namespace

std::string Times::text() const {
  const std::string others =
      starved == 0 ? "" : "; " + std::to_string(starved) + " too late, but starved";
  if (each.empty()) return "none" + others;
  std::vector<Nanoseconds> sorted = each;
  std::sort(sorted.begin(), sorted.end());
  const auto at = [&](double share) {
    const auto place = static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1));
    return static_cast<double>(sorted[place]) / 1e6;
  };
  char text[120];
  std::snprintf(text, sizeof text,
                "%zu: half within %.0f ms, 95%% within %.0f ms, all within %.0f ms", sorted.size(),
                at(0.5), at(0.95), at(1));
  return text + others;
}

void Happenings::add(Nanoseconds lasts) {
  // As they are drawn, and as far as a short round lets them last.
  const std::size_t place = lasts < kSecond        ? 0
                            : lasts < 5 * kSecond  ? 1
                            : lasts < 30 * kSecond ? 2
                                                   : 3;
  ++lasting[place];
}

Judge::Judge(const Options& options, const Plan& plan, const History& history, Totals& totals)
    : options_(options), plan_(plan), history_(history), totals_(totals) {}

Findings Judge::judge(const std::vector<HostEvidence>& hosts) {
  for (unsigned number = 1; number <= hosts.size(); ++number) {
    const HostEvidence& importer = hosts[number - 1];
    judge_commands(importer, number);
    check_speakers(importer, number, history_, found_, totals_.checked);
    judge_successions(importer, number);
    for (unsigned other = 1; other <= hosts.size(); ++other) {
      check_order(importer, source_of(other), found_);
      check_order(said_by(importer, kShared, other), kShared, found_);
      if (other == number) continue;
      const Pair pair{importer, hosts[other - 1], number, other, source_of(other)};
      judge_import(pair);
      if (plan_.has_losers && is_large(other)) judge_losers(pair);
      judge_ends(pair);
      judge_shared(pair);
      judge_closing(pair, {other, number});
      judge_closing(pair, {number, other});
      measure(pair);
    }
  }
  check_switches(hosts, history_, found_, totals_.checked);
  return std::move(found_);
}

void Judge::judge_commands(const HostEvidence& host, unsigned number) {
  check_decisions(host, found_, totals_.checked);
  const HostPlan& plan = plan_.hosts[number - 1];
  std::map<std::string, Ranked> ranks;
  for (unsigned model = 0; model < kModels.size(); ++model) {
    const std::vector<unsigned>& order = plan.orders[model];
    ranks[kShared] = {static_cast<unsigned>(order.size()), kModelTimeout};
    ranks[hold_of(number)] = {static_cast<unsigned>(order.size()) + 1, kModelTimeout};
    const auto rank_all = [&](auto timeout_of) {
      for (unsigned rank = 0; rank < order.size(); ++rank) {
        ranks[source_of(order[rank])] = {rank, timeout_of(order[rank])};
      }
    };
    // What has arrived under one model is active for that one's T, also under the next.
    rank_all([&](unsigned other) { return std::get<0>(timeouts_of(plan, other)); });
    check_winners(host, kModels[model], ranks, found_, totals_.checked);
    rank_all([&](unsigned other) { return std::get<1>(timeouts_of(plan, other)); });
  }
  judge_fallbacks(host, number, ranks, hold_of(number));
  // Where its own component has the source open.
  ranks.erase(hold_of(number));
  judge_fallbacks(host, number, ranks, kShared);
}

void Judge::judge_fallbacks(const HostEvidence& host, unsigned number,
                            const std::map<std::string, Ranked>& ranks, const std::string& last) {
  for (const Fallback& each : fallbacks(host, ranks, last, kIdle)) {
    const Span when{each.since, each.since + kIdle};
    const bool is_told =
        history_.is_quiet(number, number, {when.from - kSettling, when.to},
                          History::Of::processes) &&
        was_there(host, last, when.from) &&
        (last != kShared || is_there(history_, number, {when.from - kPromised, when.to}));
    if (!is_told) continue;
    hold_to(totals_.fallbacks, each.next, kNextCommand,
            history_.waits.waited(number, when.from, when.to),
            host.name + ": " + last + " commanded, when it was the only one,");
  }
}

void Judge::judge_import(const Pair& pair) {
  check_age(
      pair.importer, pair.exporter, pair.source,
      [&](Nanoseconds time) { return most_age(pair, time); }, found_, totals_.checked);
  const auto cuts = history_.cuts.find({pair.other, pair.number});
  if (cuts != history_.cuts.end()) check_cuts(pair.importer, pair.source, cuts->second, found_);
  // The link that counts is the last one.
  const HostHistory& its = history_.hosts[pair.number - 1];
  std::vector<Span> spans{{0, its.link_since}};
  for (const Span& span : history_.hosts[pair.other - 1].without_link) {
    spans.push_back({span.from, span.to + kAfterRestart});
  }
  const std::uint64_t counted = counted_in(its.imports[pair.other - 1].described);
  check_losses(pair.importer, pair.source, counted, spans, found_, totals_.checked);
  const std::size_t before = found_.size();
  check_counts(pair.importer, pair.exporter, pair.source, counted,
               kStatesOfAJoin * history_.troubles_of(pair.number, pair.other, its.link_since),
               its.link_since, found_);
  if (found_.size() != before) found_.back() += ": " + its.imports[pair.other - 1].described;
}

// Of what stays at home and wins, the sample comes before the next one has, unless a process waited
// for a processor for so long. Something is nearly always troubled: then some come too late.
void Judge::judge_losers(const Pair& pair) {
  totals_.checked.withheld +=
      withheld_in(history_.hosts[pair.number - 1].imports[pair.other - 1].described);
  for (const Asked& each : asked_for(pair.importer, pair.source)) {
    const Span when{each.when, each.when + plan_.period};
    if (waited(pair.number, pair.other, when) > plan_.period) continue;
    ++totals_.checked.asked;
    totals_.checked.completed += each.is_completed ? 1 : 0;
  }
}

// The last event gets through, also where it was lost first. Where nothing has been lost, one that
// is soon followed does, too.
void Judge::judge_ends(const Pair& pair) {
  check_ends(pair.importer, pair.exporter, pair.source, found_, totals_.checked);
  for (const End& end : ends_of(pair.exporter, pair.source)) {
    Nanoseconds since = end.when;
    for (const Troubled& each : history_.troubled) {
      const bool is_of_them = each.host == 0 || each.host == pair.number || each.host == pair.other;
      const bool is_of_it = is_of_them && is_of_frames(each.trouble) &&
                            each.span.from < end.until && end.when < each.span.to + kSettling;
      if (is_of_it) since = std::max(since, each.span.to + kSettling);
    }
    const bool is_undisturbed =
        since == end.when &&
        history_.is_quiet(pair.number, pair.other, {end.when - kPromised, end.when},
                          History::Of::anything) &&
        was_there(pair.importer, pair.source, end.when);
    const Span when{since,
                    is_undisturbed ? std::min(end.until, since + kPromised) : since + kPromised};
    const bool is_told =
        end.until >= when.to && when.to < history_.until &&
        history_.is_quiet(pair.number, pair.other, {end.when - kNotTroubled, when.to},
                          History::Of::processes) &&
        history_.is_quiet(pair.number, pair.other, when, History::Of::anything);
    if (!is_told) continue;
    Recovery told = first_end_after(pair.importer, pair.source, end.when, !is_undisturbed);
    told.took = std::max<Nanoseconds>(told.took - (since - end.when), 0);
    hold_to(totals_.ends, told, kPromised, waited(pair.number, pair.other, when),
            pair.importer.name + ": the deactivation of " + pair.source + " at " +
                std::to_string(end.when / kMs) + " ms came");
  }
}

void Judge::judge_shared(const Pair& pair) {
  const HostEvidence said = said_by(pair.importer, kShared, pair.other);
  const HostEvidence spoken = said_by(pair.exporter, kShared, pair.other);
  check_age(
      said, spoken, kShared, [](Nanoseconds) { return kModelTimeout; }, found_, totals_.checked);
  const auto cuts = history_.cuts.find({pair.other, pair.number});
  if (cuts != history_.cuts.end()) check_cuts(said, kShared, cuts->second, found_);
}

// A speaker of a source that is active for ever is not kept where one of the two does not hear the
// other.
void Judge::judge_closing(const Pair& pair, const Direction& direction) {
  const auto cuts = history_.cuts.find(direction);
  if (cuts == history_.cuts.end()) return;
  for (const Span& cut : cuts->second) {
    const Span when{cut.from, cut.from + kSurelyGone};
    const bool is_told = cut.to > when.to && is_over(cut) && timeout_in(pair, when) == kForever &&
                         was_there(pair.importer, pair.source, cut.from) &&
                         history_.is_quiet(pair.number, pair.number, when, History::Of::processes);
    if (!is_told) continue;
    Recovery closed = closed_after(pair.importer, pair.source, cut.from);
    if (closed.took > cut.to - cut.from) closed = {};
    hold_to(totals_.closings, closed, kSurelyGone, waited(pair.number, pair.number, when),
            pair.importer.name + ": the port of " + pair.source + ", whose T is forever, was " +
                "closed in a cut of " + std::to_string((cut.to - cut.from) / kMs) + " ms from " +
                instance_of(direction.first) + " to " + instance_of(direction.second));
  }
}

std::optional<Nanoseconds> Judge::timeout_in(const Pair& pair, const Span& when) const {
  const HostPlan& plan = plan_.hosts[pair.number - 1];
  for (unsigned model = 0; model < kModels.size(); ++model) {
    if (had_model(pair.importer, kModels[model], when.from, when.to)) {
      return plan.timeouts[model][pair.other - 1];
    }
  }
  return std::nullopt;
}

Nanoseconds Judge::most_age(const Pair& pair, Nanoseconds time) const {
  const auto most = [](Nanoseconds timeout) {
    return timeout == kForever ? kModelTimeout : timeout;
  };
  if (const auto known = timeout_in(pair, {time - kKnowsItsModel, time})) return most(*known);
  Nanoseconds result = 0;
  for (const auto& timeouts : plan_.hosts[pair.number - 1].timeouts) {
    result = std::max(result, most(timeouts[pair.other - 1]));
  }
  return result;
}

void Judge::judge_successions(const HostEvidence& host, unsigned number) {
  for (const Succession& each : successions(host, number, history_)) {
    hold_to(totals_.successions, each.recovery, each.when.to - each.when.from,
            waited(number, each.from, each.when) + waited(each.to, each.to, each.when),
            host.name + ": " + kShared + " of " + instance_of(each.to) + " came after that of " +
                instance_of(each.from));
  }
}

void Judge::measure(const Pair& pair) {
  for (const Troubled& each : history_.troubled) {
    const bool is_of_them = each.host == 0 || each.host == pair.other ||
                            (each.host == pair.number && each.trouble != Trouble::component_kill);
    const bool counts = is_of_frames(each.trouble) || is_of_processes(each.trouble);
    if (is_of_them && counts && !is_cut(each.trouble) && is_over(each.span)) {
      measure_one(pair, each.trouble, each.span);
    }
  }
  const auto cuts = history_.cuts.find({pair.other, pair.number});
  if (cuts == history_.cuts.end()) return;
  for (const Span& cut : cuts->second) {
    if (is_over(cut)) measure_one(pair, Trouble::cut, cut);
  }
}

void Judge::measure_one(const Pair& pair, Trouble trouble, const Span& span) {
  const Recovery published = first_arrival_after(pair.exporter, pair.source, span.to);
  if (!published.is_there) return;
  const Span when{span.to + published.took, span.to + published.took + kPromised};
  const Recovery arrived = recovery_after(pair.importer, pair.exporter, pair.source, span.to);
  if (!arrived.is_there) return;
  const Nanoseconds its_waits = waited(pair.number, pair.other, when);
  // Else something else delayed it.
  const Nanoseconds until = when.from + std::min(arrived.took, kPromised + its_waits);
  if (!history_.is_quiet(pair.number, pair.other, {span.to + kSettling, until},
                         History::Of::anything)) {
    return;
  }
  // Where processes begin anew, or have just begun, nothing is promised.
  const bool is_promised =
      is_of_frames(trouble) &&
      history_.is_quiet(pair.number, pair.other, {span.to - kNotTroubled, until},
                        History::Of::processes);
  hold_to(totals_.recoveries[trouble], arrived, is_promised ? kPromised : kLong, its_waits,
          pair.importer.name + ": " + pair.source + " came back after \"" + name_of(trouble) +
              "\" of " + std::to_string((span.to - span.from) / kMs) + " ms, ended at " +
              std::to_string(span.to / kMs) + " ms,");
}

Nanoseconds Judge::waited(unsigned one, unsigned other, const Span& when) const {
  Nanoseconds sum =
      history_.waits.waited(0, when.from, when.to) + history_.waits.waited(one, when.from, when.to);
  if (other != one) sum += history_.waits.waited(other, when.from, when.to);
  return sum;
}

void Judge::hold_to(Times& times, const Recovery& recovery, Nanoseconds most, Nanoseconds waited,
                    const std::string& what) {
  if (recovery.is_there) times.each.push_back(recovery.took);
  if (recovery.is_there && recovery.took <= most + waited) return;
  if (waited > kStarved) {
    ++times.starved;
    return;
  }
  if (!options_.has_bounds) return;
  found_.push_back(what +
                   (recovery.is_there ? " after " + std::to_string(recovery.took / kMs) + " ms"
                                      : std::string(" never")) +
                   ", more than " + std::to_string(most / kMs) + " ms and the " +
                   std::to_string(waited / kMs) + " ms that processes waited for a processor");
}

}  // namespace arbiter::failures
