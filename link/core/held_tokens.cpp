#include "link/core/held_tokens.hpp"

#include <algorithm>

namespace arbiter::link {

bool HeldTokens::note(Incarnation importer, std::uint64_t number, std::uint64_t writer,
                      shm::Nanoseconds now) {
  const std::lock_guard lock(mutex_);
  forget_silent(now);
  const auto found = held_.find(importer);
  if (found == held_.end() || found->second.writer != writer) {
    const bool is_anothers = found != held_.end() && now - found->second.heard < kOtherWriter;
    if (is_anothers || has_other_name(writer)) return false;
    if (found == held_.end() && !make_place(now)) return false;
  }
  Held& held = found != held_.end() ? found->second : held_[importer];
  // One that went on in its own life has sent higher numbers since. If these are lower, the writer
  // before was a stranger, whose numbers would keep all of its own from being named.
  if (held.writer != writer && number <= held.times.last()) held.times = {};
  held.writer = writer;
  held.heard = now;
  held.times.note(number, now);
  return true;
}

// Of one that writes in its own name this is not asked: it costs a look at all.
bool HeldTokens::has_other_name(std::uint64_t writer) const {
  return std::any_of(held_.begin(), held_.end(),
                     [&](const auto& each) { return each.second.writer == writer; });
}

// Else each event would name the lives of all links that ever imported.
void HeldTokens::forget_silent(shm::Nanoseconds now) {
  if (now < sweep_again_) return;
  sweep_again_ = now + kSilence;
  std::erase_if(held_, [&](const auto& each) { return now - each.second.heard > kForgotten; });
}

bool HeldTokens::make_place(shm::Nanoseconds now) {
  if (held_.size() < kMaxImporters) return true;
  const auto silent = std::min_element(
      held_.begin(), held_.end(),
      [](const auto& a, const auto& b) { return a.second.heard < b.second.heard; });
  if (now - silent->second.heard < kSilence) return false;
  held_.erase(silent);
  return true;
}

void HeldTokens::name(shm::Nanoseconds published, std::vector<NamedToken>& named) const {
  named.clear();
  const std::lock_guard lock(mutex_);
  for (const auto& [importer, held] : held_) {
    const std::uint64_t newest = held.times.newest_by(published);
    if (newest != 0) named.push_back({importer, newest});
  }
}

}  // namespace arbiter::link
