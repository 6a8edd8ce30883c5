#include "watch/winners.hpp"

#include <set>
#include <utility>

#include "rules/explain/tenure.hpp"

namespace arbiter::watch {

Winners::Winners(std::shared_ptr<Instance> instance, Wanted wanted)
    : instance_(std::move(instance)), wanted_(std::move(wanted)) {}

// Those that the model in force mentions, and those that were there at the last look.
std::map<std::string, shm::PortId> Winners::ports(const shm::TableView& table) const {
  std::map<std::string, shm::PortId> ports;
  for (const auto& [id, name] : instance_->port_names()) {
    if (!table.is_arbitrated(id) && now_.count(name) == 0) continue;
    if (wanted_(name)) ports[name] = id;
  }
  return ports;
}

Picture Winners::take(const shm::DecisionMemory& memory) const {
  return take_picture(memory, [&](const shm::TableView& table) {
    std::set<shm::SourceId> sources;
    for (const auto& [name, id] : ports(table)) {
      if (!table.is_arbitrated(id)) continue;
      const auto heeded = rules::sources_heeded(table, id);
      sources.insert(heeded.begin(), heeded.end());
    }
    return std::vector<shm::SourceId>(sources.begin(), sources.end());
  });
}

std::vector<WinnerAt> Winners::look() {
  const auto memory = instance_->memory();
  Picture picture = take(*memory);
  const shm::TableView& table = picture.snapshot.table;
  std::vector<WinnerAt> news;
  std::map<std::string, WinnerAt> all;
  for (const auto& [name, id] : ports(table)) {
    const auto last = now_.find(name);
    if (!sees_port(*memory, picture, id)) {  // who wins is not known
      if (last != now_.end()) all.insert(*last);
      continue;
    }
    WinnerAt at{name, {}, {}};
    at.is_arbitrated = table.is_arbitrated(id);
    at.generation = picture.snapshot.generation;
    at.time = at.seen = picture.now;
    const shm::SourceId winner = picture.winner_at(id);
    if (winner != shm::kNone) at.winner = memory->source_name(winner);
    at.is_first = last == now_.end();
    if (!at.is_first) at.before = last->second.winner;
    const bool is_news =
        at.is_first || at.winner != at.before || at.is_arbitrated != last->second.is_arbitrated;
    if (!is_news) {
      at.time = last->second.time;
    } else if (memory == memory_) {
      at.time = time_of(at, id, picture);
    }
    all[name] = at;
    if (is_news) news.push_back(std::move(at));
  }
  // What the memory no longer says as it was read may be of two models: look again.
  if (!picture.is_settled || !memory->tables().is_whole(picture.snapshot)) return {};
  memory_ = memory;
  picture_ = std::move(picture);
  now_ = std::move(all);
  return news;
}

shm::Nanoseconds Winners::time_of(const WinnerAt& change, shm::PortId port,
                                  const Picture& picture) const {
  if (change.is_first || picture.snapshot.generation != picture_.snapshot.generation) {
    return picture.now;
  }
  return picture.selected_since(picture_, port);
}

}  // namespace arbiter::watch
