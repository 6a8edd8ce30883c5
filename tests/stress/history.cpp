#include "tests/stress/history.hpp"

#include <algorithm>
#include <utility>

namespace arbiter::stress {
namespace {

constexpr std::int64_t kEver = INT64_MAX;
constexpr std::uint32_t kNoRecord = 0xffffffff;

std::string at(std::int64_t time) { return std::to_string(time % 1'000'000'000'000) + " ns"; }

}  // namespace

History::History(const Plan& plan, Records& records, std::vector<Swap> swaps)
    : plan_(plan), records_(records), swaps_(std::move(swaps)), sources_(plan.sources.size()) {
  for (std::uint32_t source = 0; source < sources_.size(); ++source) read_source(source);
}

void History::read_source(std::uint32_t source) {
  SourceHistory& history = sources_[source];
  const Log<Arrival>& log = records_.arrivals[source];
  const std::int64_t timeout = plan_.sources[source].timeout_ns;
  const auto after = [&](std::int64_t time) { return timeout == 0 ? kEver : time + timeout; };
  bool active = false;  // surely
  Interval now{0, 0};
  std::int64_t silent_from = 0;  // surely inactive from here on; kEver: it may be active
  const auto close = [&](std::int64_t until) {
    if (active && std::min(now.until, until) > now.from) {
      history.active.push_back({now.from, std::min(now.until, until)});
    }
    active = false;
  };
  const std::uint64_t count = log.size();
  for (std::uint64_t i = 0; i < count; ++i) {
    const Arrival& record = log.records[i];
    const std::int64_t end = record.end.load(std::memory_order_acquire);
    if (record.act == Act::kDeactivate) {
      close(record.begin);
      // One that did not return may have done nothing.
      if (end != 0) silent_from = end;
      continue;
    }
    if (record.number != 0) {
      history.by_number.resize(std::max<std::size_t>(history.by_number.size(), record.number + 1),
                               kNoRecord);
      history.by_number[record.number] = static_cast<std::uint32_t>(i);
    }
    if (silent_from < record.begin) history.inactive.push_back({silent_from, record.begin});
    if (end == 0) {  // it may or may not have arrived, until its successor came
      silent_from = i + 1 == count ? kEver : after(log.records[i + 1].begin);
      continue;
    }
    silent_from = after(end);
    if (active && end <= now.until) {
      now.until = after(record.begin);
    } else {
      close(kEver);
      now = {end, after(record.begin)};
      active = true;
    }
  }
  close(kEver);
  if (silent_from != kEver) history.inactive.push_back({silent_from, kEver});
}

bool History::Picture::covers(const std::vector<Interval>& intervals, std::size_t& at,
                              std::int64_t begin, std::int64_t end) {
  while (at < intervals.size() && intervals[at].until <= begin) ++at;
  return at < intervals.size() && intervals[at].from <= begin && intervals[at].until >= end;
}

void History::Picture::look(std::int64_t begin, std::int64_t end) {
  active = inactive = 0;
  for (std::uint32_t source = 0; source < at_.size(); ++source) {
    const SourceHistory& history = history_.sources_[source];
    if (covers(history.active, at_[source].active, begin, end)) active |= bit(source);
    if (covers(history.inactive, at_[source].inactive, begin, end)) inactive |= bit(source);
  }
  const std::vector<Swap>& swaps = history_.swaps_;
  while (model_ + 1 < swaps.size() && swaps[model_ + 1].end < begin) ++model_;
  models = 1u << swaps[model_].model;
  for (std::size_t i = model_ + 1; i < swaps.size() && swaps[i].begin <= end; ++i) {
    models |= 1u << swaps[i].model;
  }
}

bool History::may_win(std::uint32_t port, std::uint32_t source, const Picture& picture) const {
  for (std::uint32_t model = 0; model < kModels; ++model) {
    if ((picture.models & 1u << model) == 0) continue;
    const RulePlan& rule = plan_.rules[model][port][source];
    if (!rule.connected) continue;
    if ((rule.need_inactive & picture.active) == 0 && (rule.need_active & picture.inactive) == 0) {
      return true;
    }
  }
  return false;
}

bool History::surely_wins(std::uint32_t port, std::uint32_t source, const Picture& picture) const {
  for (std::uint32_t model = 0; model < kModels; ++model) {
    if ((picture.models & 1u << model) == 0) continue;
    const RulePlan& rule = plan_.rules[model][port][source];
    if (!rule.connected || (rule.need_inactive & ~picture.inactive) != 0 ||
        (rule.need_active & ~picture.active) != 0) {
      return false;
    }
  }
  return true;
}

void History::check_source(std::uint32_t source, bool all_open, Checked& checked) {
  const Log<Arrival>& log = records_.arrivals[source];
  Picture picture(*this);
  for (std::uint64_t i = 0; i < log.size(); ++i) {
    const Arrival& record = log.records[i];
    const std::int64_t end = record.end.load(std::memory_order_acquire);
    if (end == 0 || record.act == Act::kDeactivate) continue;
    ++checked.arrivals;
    picture.look(record.begin, end);
    std::uint32_t may = 0;
    std::uint32_t must = 0;
    for (std::uint32_t port = 0; port < plan_.ports.size(); ++port) {
      may += may_win(port, source, picture) ? 1 : 0;
      must += surely_wins(port, source, picture) ? 1 : 0;
    }
    if (record.act == Act::kSignal) continue;  // nothing is delivered
    const std::uint32_t accepted = record.delivered + record.refused;
    if (accepted > may) {
      records_.fail(source_name(source) + "'s sample " + std::to_string(record.number) +
                    " was accepted at " + std::to_string(accepted) +
                    " ports, though it could win at " + std::to_string(may) + " at most, between " +
                    at(record.begin) + " and " + at(end));
    }
    if (all_open && accepted < must) ++checked.too_few;
  }
}

std::string History::describe(const Taking& taking) const {
  return "sample " + std::to_string(taking.number) + " of " + source_name(taking.source) +
         " by receiver " + std::to_string(taking.incarnation) + ", arrived " + at(taking.stamp) +
         ", taken from " + at(taking.begin) + " to " + at(taking.end);
}

void History::fail(std::uint32_t port, std::uint64_t index, const std::string& what) {
  std::string text = port_name(port) + ": " + what;
  const Log<Taking>& log = records_.takings[port];
  for (std::uint64_t i = index < 3 ? 0 : index - 3; i <= index; ++i) {
    text += "\n    " + describe(log.records[i]);
  }
  records_.fail(text);
}

void History::check_port(std::uint32_t port, Checked& checked) {
  const Log<Taking>& log = records_.takings[port];
  Picture picture(*this);
  std::vector<std::uint64_t> last(sources_.size());
  std::int64_t latest_begin = 0;  // of the publish() of what was taken so far
  for (std::uint64_t i = 0; i < log.size(); ++i) {
    const Taking& taking = log.records[i];
    ++checked.takes;
    const SourceHistory& history = sources_[taking.source];
    const bool known =
        taking.number < history.by_number.size() && history.by_number[taking.number] != kNoRecord;
    if (!known) {
      fail(port, i, "a sample that nobody has published");
      continue;
    }
    const Arrival& arrival =
        records_.arrivals[taking.source].records[history.by_number[taking.number]];
    const std::int64_t published = arrival.end.load(std::memory_order_acquire);
    if (taking.end < arrival.begin) fail(port, i, "taken before it was published");
    if (taking.stamp < arrival.begin || (published != 0 && taking.stamp > published)) {
      fail(port, i, "its time of arrival is not that of its publish()");
    }
    if (taking.number <= last[taking.source]) fail(port, i, "twice, or out of order");
    last[taking.source] = std::max(last[taking.source], taking.number);
    if (published != 0 && published < latest_begin) {
      fail(port, i, "after a sample that was published later");
    }
    latest_begin = std::max(latest_begin, arrival.begin);
    if (plan_.ports[port].keep) continue;
    picture.look(taking.begin, taking.end);
    if (picture.active != 0) ++checked.hard_takes;
    if (!may_win(port, taking.source, picture)) {
      fail(port, i,
           "taken though its rule was false throughout; surely active " +
               std::to_string(picture.active) + ", surely inactive " +
               std::to_string(picture.inactive) + ", models " + std::to_string(picture.models) +
               " (bits)");
    }
  }
}

Checked History::check(bool all_open) {
  Checked checked;
  for (std::uint32_t source = 0; source < sources_.size(); ++source) {
    check_source(source, all_open, checked);
  }
  for (std::uint32_t port = 0; port < plan_.ports.size(); ++port) check_port(port, checked);
  return checked;
}

}  // namespace arbiter::stress
