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

bool has_ended(const test::ChildProcess& process) {
  pollfd ended{process.descriptor(), POLLIN, 0};
  return ::poll(&ended, 1, 0) == 1;
}

}  // namespace

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

void Round::pass(Nanoseconds time) {
  ::poll(nullptr, 0, static_cast<int>(time / kMs));
  operators_.reap();
  history_.waits.look(static_cast<unsigned>(hosts_.size()), [&](unsigned number) {
    return number == 0 ? std::vector<pid_t>{::getpid()} : host(number).pids();
  });
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
  history_.until = now();
  history_.switches = operators_.end();
  for (const auto& each : hosts_) history_.hosts.push_back(each->history());
  for (const auto& each : hosts_) each->end(found);
  check(found);
  ++totals_.rounds;
  ++totals_.rounds_of[static_cast<unsigned>(hosts_.size())];
  totals_.rounds_with_losers += plan_.has_losers ? 1 : 0;
  totals_.late_interfaces += plan_.late_host != 0 ? 1 : 0;
  const Passed passed = relay_.passed();
  totals_.passed.frames += passed.frames;
  totals_.passed.cut += passed.cut;
  totals_.passed.lost += passed.lost;
  totals_.passed.doubled += passed.doubled;
  totals_.passed.delayed += passed.delayed;
  totals_.passed.overtaken += passed.overtaken;
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
      // Nobody comes back before it.
      history_.troubled.push_back({plan_.late_host, Trouble::unplugged, {begin_, now()}});
      is_late = false;
    }
    for (std::size_t i = 0; i < ongoing_.size();) {
      if (ongoing_[i].until > time) {
        ++i;
        continue;
      }
      // It is not among them any more when the faults are made anew.
      const Ongoing ended = ongoing_[i];
      ongoing_.erase(ongoing_.begin() + static_cast<std::ptrdiff_t>(i));
      if (!end(ended.event)) {
        ongoing_.insert(ongoing_.begin() + static_cast<std::ptrdiff_t>(i++), ended);
      }
    }
    if (next != plan_.events.end() && next->at <= time) begin(*next++);
    pass(2 * kMs);
  }
}

void Round::begin(const Event& event) {
  const bool is_on_host = is_of_processes(event.trouble);
  if (event.host == plan_.late_host && host(event.host).network().cable() < 0) return;
  const bool is_skipped = (is_on_host && is_busy_[event.host]) ||
                          (event.trouble == Trouble::rival && is_sharing_[event.host]);
  if (is_skipped) {
    ++totals_.troubles[event.trouble].skipped;
    return;
  }
  totals_.troubles[event.trouble].add(event.lasts);
  if (!is_on_host && !is_of_frames(event.trouble) && event.trouble != Trouble::rival) {
    begin_switch(event);
    return;
  }
  const Nanoseconds since = now();
  history_.troubled.push_back(
      {is_of_all(event.trouble) ? 0 : event.host, event.trouble, {since, since + kLong}});
  ongoing_.push_back({event, now() - begin_ + event.lasts});
  if (is_on_host) {
    is_busy_[event.host] = true;
    change_processes(event, true);
  } else if (event.trouble == Trouble::rival) {
    change_shared(event, true);
  } else {
    renew_faults();
  }
}

void Round::begin_switch(const Event& event) {
  operators_.start(host(event.host), event.model);
  if (event.trouble == Trouble::switch_twice) operators_.start(host(event.other), 1 - event.model);
}

bool Round::end(const Event& event) {
  if (event.trouble == Trouble::switch_death && operators_.has_killer()) return false;
  if (is_of_processes(event.trouble)) {
    change_processes(event, false);
    is_busy_[event.host] = false;
  } else if (event.trouble == Trouble::rival) {
    change_shared(event, false);
  } else {
    renew_faults();
  }
  note_end(event);
  return true;
}

void Round::note_end(const Event& event) {
  for (Troubled& each : history_.troubled) {
    const bool is_it = each.host == (is_of_all(event.trouble) ? 0 : event.host) &&
                       each.trouble == event.trouble && each.span.to - each.span.from == kLong;
    if (!is_it) continue;
    each.span.to = now();
    break;
  }
}

// Who speaks falls silent for a while, and who is silent speaks.
void Round::change_shared(const Event& event, bool begins) {
  is_sharing_[event.host] = begins;
  if (host(event.host).has_rival()) {
    host(event.host).end_rival(event.is_abrupt);
  } else {
    host(event.host).start_rival();
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
    case Trouble::switch_death:
      if (begins) {
        one.expect_death_of_link();
        operators_.start_killer(host(event.other), event.model, one);
      } else {
        one.kill_link();
        one.start_link();
      }
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

std::vector<Direction> Round::directions_of(const Event& event) const {
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
    if (!is_of_frames(ongoing.event.trouble)) continue;
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
      std::vector<Span>& spans = history_.cuts[direction];
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
  std::vector<std::vector<Import>> before;
  for (const auto& each : hosts_) before.push_back(each->imports());
  const Nanoseconds since = now();
  for (std::size_t i = 0; i < hosts_.size();) {
    const auto imports = hosts_[i]->imports();
    bool flows = true;
    for (std::size_t j = 0; j < imports.size(); ++j) {
      // A port that was opened again since counts from 0.
      const bool goes_on = imports[j].arrived >= before[i][j].arrived + kFlowing;
      if (imports[j].arrived < before[i][j].arrived) before[i][j].arrived = 0;
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
                std::to_string(before[i][j].arrived) + " then " +
                std::to_string(imports[j].arrived) + " (" + imports[j].described + ")";
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
  std::vector<std::vector<Import>> before;
  for (Nanoseconds since = now(); now() - since < kAtRest; pass(50 * kMs)) {
    std::vector<std::vector<Import>> at_present;
    for (const auto& each : hosts_) at_present.push_back(each->imports());
    if (at_present == before) continue;
    before = std::move(at_present);
    since = now();
  }
}

// No recorder has taken them.
void Round::name_large(std::vector<HostEvidence>& evidence) const {
  for (const auto& exporter : hosts_) {
    const unsigned number = exporter->number();
    if (!is_large(number)) continue;
    const std::string source = source_of(number);
    HostEvidence& its = evidence[number - 1];
    name_own(its, source, number);
    for (HostEvidence& importer : evidence) name_imported(importer, its, source);
  }
}

void Round::check(Findings& found) {
  std::vector<HostEvidence> evidence;
  for (const auto& each : hosts_) {
    try {
      evidence.push_back(read_evidence(each->name(), motor_of(each->number()), each->recording()));
      evidence.back().lives = history_.hosts[each->number() - 1].component_lives;
    } catch (const std::exception& error) {
      found.push_back(each->name() + ": its recording: " + error.what());
      return;
    }
  }
  if (plan_.has_losers) name_large(evidence);
  const Findings judged = Judge(options_, plan_, history_, totals_).judge(evidence);
  found.insert(found.end(), judged.begin(), judged.end());
  for (const auto& each : hosts_) each->add_seen_by_component(found);
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
