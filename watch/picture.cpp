#include "watch/picture.hpp"

#include <algorithm>
#include <utility>

#include "rules/explain/tenure.hpp"
#include "shm/clock.hpp"
#include "shm/decision.hpp"
#include "shm/limits.hpp"

namespace arbiter::watch {
namespace {

// A source as it is looked at twice.
struct Seen {
  shm::SourceId source = shm::kNone;
  const shm::Activity* page = nullptr;  // null: there is none here yet
  shm::SeenActivity first{};
};

// All words are collected, the clock is read, and all are looked at again: if they stand, they
// stood together when the clock was read.
bool try_once(const shm::DecisionMemory& memory, const SourcesOf& sources_of, Picture& picture) {
  picture = {};
  picture.snapshot = memory.tables().snapshot();
  const shm::TableView& table = picture.snapshot.table;
  std::vector<Seen> seen;
  if (picture.snapshot.generation != 0) {
    for (const shm::SourceId source : sources_of(table)) {
      const shm::Activity* page = memory.pages().find(source);
      seen.push_back({source, page, page ? shm::SeenActivity::of(*page) : shm::SeenActivity{}});
    }
  }
  picture.now = shm::monotonic_now();
  picture.is_settled = std::all_of(seen.begin(), seen.end(), [&](const Seen& each) {
    return each.page == nullptr || each.first.stands(shm::SeenActivity::of(*each.page),
                                                     table.timeout(each.source), picture.now);
  });
  for (const Seen& each : seen) {
    picture.words[each.source] = each.page ? each.first.word : shm::kNeverActive;
    if (each.page == nullptr) picture.unseen.push_back(each.source);
  }
  return memory.tables().is_in_force(picture.snapshot) && picture.is_settled;
}

}  // namespace

bool Picture::is_unseen(shm::SourceId source) const {
  return std::binary_search(unseen.begin(), unseen.end(), source);
}

shm::SourceId Picture::winner_at(shm::PortId port) const {
  if (!snapshot.table.is_arbitrated(port)) return shm::kNone;
  return rules::winner_at(snapshot.table, port,
                          [this](shm::SourceId source) { return is_active(source); });
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
