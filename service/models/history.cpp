#include "service/models/history.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <set>
#include <utility>

#include <nlohmann/json.hpp>

namespace arbiter::service {

std::int64_t calendar_ms() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
}

void History::add(PastModel entry) {
  if (entry.content == 0) entry.content = entry.generation;
  if (entry.how == kInherited) {
    has_inherited_ = true;
  } else {
    first_own_ = std::min(first_own_, entry.generation);
  }
  models_.push_back(std::move(entry));
  if (models_.size() > kMaxEntries) models_.pop_front();
  forget_what_does_not_fit();
}

// One model may stand at several places, and costs once.
void History::forget_what_does_not_fit() {
  std::set<const Model*> kept;
  std::size_t size = 0;
  for (auto entry = models_.rbegin(); entry != models_.rend(); ++entry) {
    if (entry->model == nullptr || kept.count(entry->model.get()) != 0) continue;
    size += size_of(*entry->model);
    if (size <= max_bytes_ || entry == models_.rbegin()) {
      kept.insert(entry->model.get());
    } else {
      entry->model = nullptr;
    }
  }
}

void History::set_changes(std::uint64_t generation, const std::string& changes) {
  for (PastModel& entry : models_) {
    if (entry.generation == generation) entry.changes = changes;
  }
}

const PastModel* History::find(std::uint64_t generation) const {
  const auto found = std::find_if(models_.begin(), models_.end(), [&](const PastModel& entry) {
    return entry.generation == generation;
  });
  return found == models_.end() ? nullptr : &*found;
}

const PastModel* History::previous() const {
  if (models_.empty()) return nullptr;
  const auto before = std::find_if(models_.rbegin(), models_.rend(), [&](const PastModel& entry) {
    return entry.generation < models_.back().content;
  });
  return before == models_.rend() ? nullptr : &*before;
}

bool History::begins_with_predecessor() const {
  return has_inherited_ && models_.back().content <= first_own_;
}

wire::PastModelStatus status_of(const PastModel& entry) {
  const auto or_nothing = [](const std::string& text) {
    return text.empty() ? std::nullopt : std::optional(text);
  };
  return {entry.generation,          entry.content,         entry.name, entry.files.models,
          entry.files.application,   entry.since_ms,        entry.how,  or_nothing(entry.by),
          or_nothing(entry.changes), entry.model != nullptr};
}

nlohmann::json to_json(const PastModel& entry) { return wire::to_json(status_of(entry)); }

std::vector<wire::PastModelStatus> History::status() const {
  std::vector<wire::PastModelStatus> result;
  for (const PastModel& entry : models_) result.push_back(status_of(entry));
  std::reverse(result.begin(), result.end());
  return result;
}

}  // namespace arbiter::service
