#include "tests/link/failures/speakers.hpp"

#include <algorithm>
#include <optional>

namespace arbiter::failures {
namespace {

// Longer than a link believes in one that is silent, and a while for the news to come.
constexpr Nanoseconds kStillTroubled = 3 * kSecond;
// A host that was starved for so long may have taken another for gone.
constexpr Nanoseconds kStarved = kSecond;

const std::vector<Happened>& shared_at(const HostEvidence& host) {
  static const std::vector<Happened> kNone;
  const auto found = host.sources.find(kShared);
  return found == host.sources.end() ? kNone : found->second;
}

bool is_there_at_all(const History& history, unsigned host, const Span& when) {
  const auto& lives = history.hosts[host - 1].rivals;
  return std::any_of(lives.begin(), lives.end(), [&](const RivalLife& life) {
    return life.span.from <= when.to && life.end() >= when.from;
  });
}

std::string text_of(unsigned host, const Happened& event) {
  return instance_of(event.command->host) + "'s " + std::to_string(event.command->life) + "." +
         std::to_string(event.command->number) + " of " + kShared + " at " + instance_of(host) +
         ", " + std::to_string(event.time / kMs) + " ms";
}

// Between the first and the last sample of each of its own lives it obeys nobody else.
void check_own(const HostEvidence& host, unsigned number, Findings& found) {
  std::map<std::uint32_t, Span> lives;
  for (const Happened& event : shared_at(host)) {
    if (!event.command || event.command->host != number) continue;
    if (event.exporter != 0) found.push_back("an import came back: " + text_of(number, event));
    lives.try_emplace(event.command->life, Span{event.time, event.time}).first->second.to =
        event.time;
  }
  for (const Happened& event : shared_at(host)) {
    if (!event.command || event.command->host == number) continue;
    for (const auto& [life, span] : lives) {
      if (event.time <= span.from || event.time >= span.to) continue;
      found.push_back("its own component had the source open: " + text_of(number, event));
    }
  }
}

// What makes it no wonder that another one is obeyed.
bool may_have_gone(const History& history, unsigned number, unsigned speaker, const Span& when) {
  const Span before{when.from - kStillTroubled, when.to};
  return !is_there(history, speaker, when) || is_there_at_all(history, number, before) ||
         !history.is_quiet(number, speaker, before, History::Of::anything) ||
         history.waits.waited(number, before.from, before.to) > kStarved ||
         history.waits.waited(speaker, before.from, before.to) > kStarved;
}

bool was_obeyed(const HostEvidence& host, unsigned speaker, Nanoseconds time) {
  const Happened* last = nullptr;
  for (const Happened& event : shared_at(host)) {
    if (event.command && event.time <= time) last = &event;
  }
  return last != nullptr && last->command->host == speaker && last->time > time - kSecond / 5;
}

Recovery next_speaker(const HostEvidence& host, unsigned gone, Nanoseconds time) {
  for (const Happened& event : shared_at(host)) {
    const bool is_other = event.command && event.command->host != gone;
    if (is_other && event.time > time) return {true, event.time - time};
  }
  return {};
}

}  // namespace

void check_speakers(const HostEvidence& host, unsigned number, const History& history,
                    Findings& found, Checked& checked) {
  check_own(host, number, found);
  const Happened* last = nullptr;
  for (const Happened& event : shared_at(host)) {
    if (!event.command || event.command->host == number) continue;
    ++checked.shared;
    if (last != nullptr && last->command->host != event.command->host) {
      ++checked.speakers;
      if (!may_have_gone(history, number, last->command->host, {last->time, event.time})) {
        found.push_back("the speaker had not gone: after " + text_of(number, *last) + " came " +
                        text_of(number, event));
      }
    }
    last = &event;
  }
}

std::vector<Succession> successions(const HostEvidence& host, unsigned number,
                                    const History& history) {
  std::vector<Succession> result;
  const auto hosts = static_cast<unsigned>(history.hosts.size());
  const auto add = [&](unsigned gone, const Span& when, History::Of unless) {
    const Span quiet{when.from - kStillTroubled, when.to};
    if (is_there_at_all(history, number, quiet) || !was_obeyed(host, gone, when.from)) return;
    std::optional<unsigned> next;  // which of several is obeyed, their names say
    for (unsigned other = 1; other <= hosts; ++other) {
      if (other == gone || other == number || !is_there_at_all(history, other, quiet)) continue;
      const bool is_sure = is_there(history, other, quiet) &&
                           history.is_quiet(number, gone, quiet, unless) &&
                           history.is_quiet(number, other, quiet, History::Of::anything);
      if (!is_sure) return;  // it may be obeyed first
      if (!next) next = other;
    }
    if (next) result.push_back({when, gone, *next, next_speaker(host, gone, when.from)});
  };
  for (unsigned gone = 1; gone <= hosts; ++gone) {
    if (gone == number) continue;
    for (const RivalLife& life : history.hosts[gone - 1].rivals) {
      const Span when{life.span.to, life.span.to + kSecond};
      if (life.span.to != 0) add(gone, when, History::Of::anything);
    }
    const auto cuts = history.cuts.find({gone, number});
    if (cuts == history.cuts.end()) continue;
    for (const Span& cut : cuts->second) {
      const Span when{cut.from, cut.from + kSurelyGone};
      if (cut.to > when.to) add(gone, when, History::Of::processes);
    }
  }
  return result;
}

}  // namespace arbiter::failures
