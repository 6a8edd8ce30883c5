#include "tests/link/failures/round.hpp"

#include <poll.h>
#include <signal.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "tests/link/failures/command.hpp"

namespace arbiter::failures {
namespace {

// Long beyond all that a healthy network needs: what has not come back by then does not.
constexpr Nanoseconds kNotBack = 60 * kSecond;
constexpr std::uint64_t kFlowing = 20;  // samples of each source
constexpr Nanoseconds kAtRest = 1500 * kMs;
// What the page promises of a healthy network.
constexpr Nanoseconds kPromised = kSecond;
// The end of a trouble is noted a little after it.
constexpr Nanoseconds kSettling = 20 * kMs;
// What a link's earlier life has sent may come so long after the next one has begun: no sample
// arrives that is older than its T.
constexpr Nanoseconds kAfterRestart = kSecond;
constexpr Nanoseconds kLong = 3'600 * kSecond;

void pass(Nanoseconds time) { ::poll(nullptr, 0, static_cast<int>(time / kMs)); }

bool has_ended(const test::ChildProcess& process) {
  pollfd ended{process.descriptor(), POLLIN, 0};
  return ::poll(&ended, 1, 0) == 1;
}

bool is_cut(Trouble trouble) {
  return trouble == Trouble::cut || trouble == Trouble::mute || trouble == Trouble::deaf ||
         trouble == Trouble::split;
}

}  // namespace

std::string Times::text() const {
  if (each.empty()) return "none";
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
  return text;
}

Round::Round(const Options& options, const Plan& plan, Totals& totals)
    : options_(options), plan_(plan), totals_(totals), relay_(plan.seed) {
  for (unsigned number = 1; number <= plan.hosts.size(); ++number) {
    hosts_.push_back(
        std::make_unique<FailingHost>(plan, number, directory_.path(), directory_.path()));
    if (number != plan.late_host) plug_in(number);
  }
}

// Daemons give back the environment in the reverse order.
Round::~Round() {
  while (!hosts_.empty()) hosts_.pop_back();
}

void Round::plug_in(unsigned number) {
  host(number).network().plug_in();
  relay_.connect(number, host(number).network().cable());
}

Findings Round::run() {
  Findings found;
  begin_ = now();
  work();
  heal();
  await_flow(found);
  await_rest();
  for (const auto& each : hosts_) imports_.push_back(each->imports());
  for (const auto& each : hosts_) each->end(found);
  check(found);
  ++totals_.rounds;
  const Passed passed = relay_.passed();
  totals_.passed.frames += passed.frames;
  totals_.passed.cut += passed.cut;
  totals_.passed.lost += passed.lost;
  totals_.passed.doubled += passed.doubled;
  totals_.passed.delayed += passed.delayed;
  if (!found.empty() && !options_.keep.empty()) keep();
  return found;
}

void Round::work() {
  auto next = plan_.events.begin();
  bool is_late = plan_.late_host != 0;
  while (next != plan_.events.end() || !ongoing_.empty() || now() < begin_ + plan_.lasts) {
    const Nanoseconds time = now() - begin_;
    if (is_late && time >= 2 * kSecond) {
      plug_in(plan_.late_host);
      is_late = false;
    }
    for (std::size_t i = 0; i < ongoing_.size();) {
      if (ongoing_[i].until > time) {
        ++i;
        continue;
      }
      const Event event = ongoing_[i].event;
      ongoing_.erase(ongoing_.begin() + static_cast<std::ptrdiff_t>(i));
      end(event);
    }
    if (next != plan_.events.end() && next->at <= time) begin(*next++);
    pass(2 * kMs);
  }
}

void Round::begin(const Event& event) {
  const bool is_of_processes = event.trouble >= Trouble::unplugged;
  if (event.host == plan_.late_host && host(event.host).network().cable() < 0) return;
  if (is_of_processes && is_busy_[event.host]) return;
  ++totals_.troubles;
  const bool is_of_all = event.trouble == Trouble::split || event.trouble == Trouble::all_noise;
  const Nanoseconds since = now();
  troubled_.push_back({is_of_all ? 0 : event.host, event.trouble, {since, since + kLong}});
  ongoing_.push_back({event, now() - begin_ + event.lasts});
  if (is_of_processes) {
    is_busy_[event.host] = true;
    change_processes(event, true);
  } else {
    renew_faults();
  }
}

void Round::end(const Event& event) {
  if (event.trouble >= Trouble::unplugged) {
    change_processes(event, false);
    is_busy_[event.host] = false;
  } else {
    renew_faults();
  }
  const bool is_of_all = event.trouble == Trouble::split || event.trouble == Trouble::all_noise;
  for (Troubled& each : troubled_) {
    const bool is_it = each.host == (is_of_all ? 0 : event.host) && each.trouble == event.trouble &&
                       each.span.to - each.span.from == kLong;
    if (!is_it) continue;
    each.span.to = now();
    break;
  }
}

void Round::change_processes(const Event& event, bool begins) {
  FailingHost& one = host(event.host);
  switch (event.trouble) {
    case Trouble::unplugged:
      one.network().set_up(!begins);
      break;
    case Trouble::host_stop:
      for (const auto* each : {&one.component(), &one.link(), &one.daemon().process()}) {
        begins ? each->stop() : each->resume();
      }
      break;
    case Trouble::link_stop:
      begins ? one.link().stop() : one.link().resume();
      break;
    case Trouble::link_kill:
      begins ? one.kill_link() : one.start_link();
      break;
    case Trouble::daemon_kill:
      begins ? one.daemon().kill() : one.daemon().restart();
      break;
    case Trouble::component_kill:
      begins ? one.kill_component() : one.start_component();
      break;
    default:
      if (begins) {
        one.kill_link();
        one.kill_component();
        one.daemon().kill();
      } else {
        one.daemon().restart();
        one.start_link();
        one.start_component();
      }
      break;
  }
}

std::vector<Round::Direction> Round::directions_of(const Event& event) const {
  std::vector<Direction> result;
  const auto hosts = static_cast<unsigned>(plan_.hosts.size());
  for (unsigned from = 1; from <= hosts; ++from) {
    for (unsigned to = 1; to <= hosts; ++to) {
      const bool leaves = from == event.host;
      const bool comes = to == event.host;
      bool is_of_it = true;
      switch (event.trouble) {
        case Trouble::mute:
        case Trouble::noise:
          is_of_it = leaves;
          break;
        case Trouble::deaf:
          is_of_it = comes;
          break;
        case Trouble::split:
          is_of_it = (from <= event.host) != (to <= event.host);
          break;
        case Trouble::all_noise:
          break;
        default:
          is_of_it = leaves || comes;
          break;
      }
      if (from != to && is_of_it) result.emplace_back(from, to);
    }
  }
  return result;
}

void Round::renew_faults() {
  std::map<Direction, Fault> faults;
  for (const Ongoing& ongoing : ongoing_) {
    if (ongoing.event.trouble >= Trouble::unplugged) continue;
    for (const Direction& direction : directions_of(ongoing.event)) {
      Fault& fault = faults[direction];
      if (is_cut(ongoing.event.trouble)) {
        fault.is_cut = true;
      } else {
        const bool before = fault.is_cut;
        fault = ongoing.event.fault;
        fault.is_cut = before;
      }
    }
  }
  const auto hosts = static_cast<unsigned>(plan_.hosts.size());
  for (unsigned from = 1; from <= hosts; ++from) {
    for (unsigned to = 1; to <= hosts; ++to) {
      if (from == to) continue;
      const Direction direction{from, to};
      std::vector<Span>& spans = cuts_[direction];
      const bool was_cut = !spans.empty() && spans.back().to == kLong;
      const bool is_now = faults[direction].is_cut;
      if (was_cut && !is_now) spans.back().to = now();
      relay_.set(from, to, faults[direction]);
      if (!was_cut && is_now) spans.push_back({now(), kLong});
    }
  }
}

void Round::heal() {
  ongoing_.clear();
  renew_faults();
  for (const auto& each : hosts_) each->component().signal(SIGUSR1);
}

// All sources come to all hosts.
void Round::await_flow(Findings& found) {
  std::vector<std::vector<FailingHost::Import>> before;
  for (const auto& each : hosts_) before.push_back(each->imports());
  const Nanoseconds since = now();
  for (std::size_t i = 0; i < hosts_.size();) {
    const auto imports = hosts_[i]->imports();
    bool flows = true;
    for (std::size_t j = 0; j < imports.size(); ++j) {
      // A port that was opened again since counts from 0.
      const bool goes_on = imports[j].published >= before[i][j].published + kFlowing;
      if (imports[j].published < before[i][j].published) before[i][j].published = 0;
      flows = flows && (i == j || goes_on);
    }
    if (flows) {
      ++i;
      continue;
    }
    if (has_ended(hosts_[i]->link()) || now() - since > kNotBack) {
      std::string text = hosts_[i]->name() + ": not all sources came back:";
      for (std::size_t j = 0; j < imports.size(); ++j) {
        if (i == j) continue;
        text += " " + source_of(static_cast<unsigned>(j + 1)) + " " +
                std::to_string(before[i][j].published) + " then " +
                std::to_string(imports[j].published) + " (" + imports[j].described + ")";
      }
      found.push_back(text);
      return;
    }
    pass(20 * kMs);
  }
  totals_.flows.each.push_back(now() - since);
}

// Until the statuses say nothing new: what links have counted is told a little later.
void Round::await_rest() {
  for (const auto& each : hosts_) each->component().signal(SIGUSR2);
  std::vector<std::vector<FailingHost::Import>> before;
  for (Nanoseconds since = now(); now() - since < kAtRest; pass(50 * kMs)) {
    std::vector<std::vector<FailingHost::Import>> at_present;
    for (const auto& each : hosts_) at_present.push_back(each->imports());
    if (at_present == before) continue;
    before = std::move(at_present);
    since = now();
  }
}

void Round::check(Findings& found) {
  std::vector<HostEvidence> evidence;
  for (const auto& each : hosts_) {
    try {
      evidence.push_back(read_evidence(each->name(), motor_of(each->number()), each->recording()));
    } catch (const std::exception& error) {
      found.push_back(each->name() + ": its recording: " + error.what());
      return;
    }
  }
  for (unsigned number = 1; number <= hosts_.size(); ++number) {
    const HostEvidence& importer = evidence[number - 1];
    const HostPlan& plan = plan_.hosts[number - 1];
    check_decisions(importer, found, totals_.checked);
    std::map<std::string, Ranked> ranks;
    for (unsigned rank = 0; rank < plan.order.size(); ++rank) {
      const Nanoseconds timeout = plan.timeouts[plan.order[rank] - 1];
      ranks[source_of(plan.order[rank])] = {rank, timeout == kForever ? kLong : timeout};
    }
    ranks[hold_of(number)] = {static_cast<unsigned>(plan.order.size()), kModelTimeout};
    check_winners(importer, ranks, found, totals_.checked);
    for (unsigned other = 1; other <= hosts_.size(); ++other) {
      check_order(importer, source_of(other), found);
      if (other != number) check_import(importer, number, evidence[other - 1], other, found);
    }
    host(number).add_seen_by_component(found);
  }
}

void Round::check_import(const HostEvidence& importer, unsigned number,
                         const HostEvidence& exporter, unsigned other, Findings& found) {
  const Nanoseconds timeout = plan_.hosts[number - 1].timeouts[other - 1];
  const std::string source = source_of(other);
  check_age(importer, exporter, source, timeout == kForever ? kModelTimeout : timeout, found,
            totals_.checked);
  check_cuts(importer, source, cuts_[{other, number}], found);
  // The link that counts is the last one.
  std::vector<Span> spans{{0, host(number).link_since()}};
  for (const Span& span : host(other).without_link()) {
    spans.push_back({span.from, span.to + kAfterRestart});
  }
  check_losses(importer, source, counted_in(imports_[number - 1][other - 1].described), spans,
               found, totals_.checked);
  measure(importer, number, exporter, other, found);
}

bool Round::is_quiet(unsigned one, unsigned other, const Span& when, Of what) const {
  return std::none_of(troubled_.begin(), troubled_.end(), [&](const Troubled& each) {
    const bool is_of_them = each.host == 0 || each.host == one || each.host == other;
    const bool counts = what == Of::anything || each.trouble >= Trouble::unplugged;
    return is_of_them && counts && each.span.from < when.to && when.from < each.span.to;
  });
}

void Round::measure(const HostEvidence& importer, unsigned number, const HostEvidence& exporter,
                    unsigned other, Findings& found) {
  const std::string source = source_of(other);
  const Nanoseconds timeout = plan_.hosts[number - 1].timeouts[other - 1];
  for (const Span& cut : cuts_[{other, number}]) {
    const Recovery next = next_in_command(importer, source, timeout, cut);
    const bool is_told = timeout != kForever && is_quiet(number, number, cut, Of::processes);
    if (next.is_there && is_told && next.took >= 0) totals_.fallbacks.each.push_back(next.took);
    if (cut.to == kLong) continue;
    const Recovery published = first_arrival_after(exporter, source, cut.to);
    const Recovery arrived = first_arrival_after(importer, source, cut.to);
    if (!published.is_there || !arrived.is_there) continue;
    const Nanoseconds took = arrived.took - published.took;
    // Else something else delayed it.
    const Nanoseconds until = cut.to + published.took + std::min(took, kPromised);
    if (!is_quiet(number, other, {cut.to + kSettling, until}, Of::anything)) continue;
    totals_.recoveries.each.push_back(std::max<Nanoseconds>(took, 0));
    if (!options_.has_bounds || took <= kPromised) continue;
    found.push_back(importer.name + ": " + source + " came back only " +
                    std::to_string(took / kMs) + " ms after a cut of " +
                    std::to_string((cut.to - cut.from) / kMs) + " ms");
  }
}

// For whoever looks into it.
void Round::keep() const {
  const std::string to = options_.keep + "/seed-" + std::to_string(plan_.seed);
  std::error_code ignored;
  std::filesystem::create_directories(options_.keep, ignored);
  std::filesystem::remove_all(to, ignored);
  std::filesystem::create_directories(to, ignored);
  for (const auto& each : std::filesystem::directory_iterator(directory_.path())) {
    if (each.is_regular_file()) std::filesystem::copy(each, to, ignored);
  }
  for (const auto& each : hosts_) {
    std::filesystem::copy(each->daemon().directory() + "/log", to + "/" + each->name() + ".log",
                          ignored);
  }
  std::fprintf(stderr, "recordings and logs: %s\n", to.c_str());
}

}  // namespace arbiter::failures
