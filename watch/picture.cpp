#include "watch/picture.hpp"

#include <algorithm>
#include <utility>

#include "rules/explain/tenure.hpp"
#include "shm/clock.hpp"
#include "shm/limits.hpp"
#include "shm/port_picture.hpp"
#include "watch/sources.hpp"

namespace arbiter::watch {
namespace {

bool try_once(const shm::DecisionMemory& memory, const SourcesOf& sources_of, Picture& picture) {
  picture = {};
  picture.snapshot = memory.tables().snapshot();
  const shm::TableView& table = picture.snapshot.table;
  std::vector<shm::Sight> sights;
  if (picture.snapshot.generation != 0) {
    for (const shm::SourceId source : sources_of(table)) {
      sights.push_back({source, memory.pages().find(source), {}});
    }
  }
  shm::DecisionClock clock(0, false);
  picture.is_settled = shm::take_picture(sights, clock);
  picture.now = clock.reading();
  for (const shm::Sight& each : sights) {
    const bool is_seen = each.activity != nullptr;
    picture.words[each.source] = is_seen ? each.seen.word : shm::kNeverActive;
    if (!is_seen) picture.unseen.push_back(each.source);
    if (!is_seen) continue;
    const auto began = shm::beginning_of(
        each.seen.word, each.activity->began.load(std::memory_order_relaxed), picture.now);
    if (began >= 0) picture.began[each.source] = began;
  }
  return memory.tables().is_in_force(picture.snapshot) && picture.is_settled;
}

}  // namespace

std::optional<shm::Nanoseconds> Picture::age_of(shm::SourceId source) const {
  const auto found = words.find(source);
  if (found == words.end()) return std::nullopt;
  const shm::Nanoseconds last = shm::time_of(found->second, snapshot.table.timeout(source));
  if (last < 0) return std::nullopt;
  return now - last;
}

std::optional<shm::Nanoseconds> Picture::beginning_of(shm::SourceId source) const {
  const auto found = began.find(source);
  return found == began.end() ? std::nullopt : std::optional(found->second);
}

shm::Nanoseconds Picture::changed_at(shm::SourceId source) const {
  const auto word = words.find(source);
  if (word == words.end()) return now;
  SourceState state{word->second, snapshot.table.timeout(source)};
  state.began = beginning_of(source);
  return event_time(state, now);
}

// One by one the causes are taken back, the latest first.
shm::Nanoseconds Picture::selected_since(const Picture& before, shm::PortId port) const {
  std::vector<shm::SourceId> causes;  // each that has changed, not one that would have been enough
  for (const shm::SourceId source : rules::sources_heeded(snapshot.table, port)) {
    if (is_active(source) != before.is_active(source)) causes.push_back(source);
  }
  std::sort(causes.begin(), causes.end(),
            [this](auto one, auto other) { return changed_at(one) < changed_at(other); });
  const auto without = [&](shm::SourceId source) {
    const bool has_changed = std::find(causes.begin(), causes.end(), source) != causes.end();
    return (has_changed ? *this : before).is_active(source);
  };
  while (!causes.empty()) {
    const shm::Nanoseconds time = changed_at(causes.back());
    causes.pop_back();
    if (shm::selected_at(snapshot.table, port, without).source == winner_at(port)) continue;
    return std::clamp(time, before.now, now);
  }
  return now;
}

bool Picture::is_unseen(shm::SourceId source) const {
  return std::binary_search(unseen.begin(), unseen.end(), source);
}

shm::SourceId Picture::winner_at(shm::PortId port) const {
  if (!snapshot.table.is_arbitrated(port)) return shm::kNone;
  const auto active = [this](shm::SourceId source) { return is_active(source); };
  return shm::selected_at(snapshot.table, port, active).source;
}

shm::Nanoseconds Picture::next_end() const {
  shm::Nanoseconds next = shm::kForever;
  for (const auto& [source, word] : words) {
    if (shm::is_finite(word) && shm::is_active(word, now)) next = std::min(next, word);
  }
  return next;
}

Picture take_picture(const shm::DecisionMemory& memory, const SourcesOf& sources_of) {
  Picture picture;
  for (int tries = 0; tries < shm::kMaxPictures; ++tries) {
    if (try_once(memory, sources_of, picture)) break;
  }
  std::sort(picture.unseen.begin(), picture.unseen.end());
  return picture;
}

bool sees(const shm::DecisionMemory& memory, const Picture& picture, shm::SourceId source) {
  // A table that is being overwritten may name any source.
  const bool is_one = source < shm::kMaxSources;
  return !picture.is_unseen(source) || (is_one && memory.tables().pages().of(source) == 0);
}

bool sees_port(const shm::DecisionMemory& memory, const Picture& picture, shm::PortId port) {
  const auto heeded = rules::sources_heeded(picture.snapshot.table, port);
  return std::all_of(heeded.begin(), heeded.end(),
                     [&](shm::SourceId source) { return sees(memory, picture, source); });
}

SourcesOf sources_at(shm::PortId port) {
  return [port](const shm::TableView& table) { return rules::sources_heeded(table, port); };
}

std::vector<shm::SourceId> all_sources(const shm::TableView& table) {
  std::vector<shm::SourceId> sources;
  for (shm::SourceId source = 0; source < shm::kMaxSources; ++source) {
    if (table.knows_source(source)) sources.push_back(source);
  }
  return sources;
}

}  // namespace arbiter::watch
