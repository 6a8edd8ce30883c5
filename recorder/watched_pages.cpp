// What activity pages tell a watcher, of sources that nobody tells of.
#include <algorithm>
#include <utility>

#include "recorder/watcher.hpp"
#include "shm/clock.hpp"
#include "shm/port_picture.hpp"

namespace arbiter::recorder {
namespace {

using evidence::ActivityWord;
using evidence::SourceContext;
using evidence::SourceState;

// What a component writes into its page may be anything. Only a kind of activity and a time that
// has come are written down: by the kind the others decide.
ActivityWord believable(ActivityWord word, Nanoseconds now) {
  if (shm::is_finite(word)) return word;
  const ActivityWord flag = shm::is_deactivation(word) ? shm::kDeactivatedFlag : shm::kForeverFlag;
  return flag | std::min(word & ~flag, now);
}

}  // namespace

ActivityWord Watcher::page_word(const std::string& source) const {
  return page_word(instance_->find_source(source));
}

ActivityWord Watcher::page_word(std::optional<shm::SourceId> id) const {
  const shm::Activity* activity = id ? memory_->pages().find(*id) : nullptr;
  return activity == nullptr ? shm::kNeverActive : shm::SeenActivity::of(*activity).word;
}

void Watcher::add_page_state(const std::string& source, Batch& batch) const {
  const ActivityWord word = page_word(source);
  add_page_state(source, word, shm::monotonic_now(), batch);
}

// `seen`: read from the clock once the page had said so.
void Watcher::add_page_state(const std::string& source, ActivityWord word, Nanoseconds seen,
                             Batch& batch) const {
  auto context = std::make_shared<SourceContext>();
  context->source = source;
  SourceState state;
  state.context = std::move(context);
  state.seen = seen;
  state.generation = generation_;
  state.word = believable(word, state.seen);
  if (shm::is_deactivation(state.word)) state.time = shm::time_of(state.word, shm::kForever);
  batch.add(std::move(state));
}

// An id becomes another source's with a page of its own.
void Watcher::find_ids() {
  const std::uint64_t pages = memory_->pages().changes();
  if (pages == pages_of_ids_) return;
  for (auto& [source, watched] : sources_) watched.id = instance_->find_source(source);
  pages_of_ids_ = pages;
}

// What nobody tells: an operator deactivates a source whose port is closed; a publisher dies
// between its arrival and telling of it. Where somebody tells, it may be that the tap was not
// polled since; so the page is believed once a whole poll has told nothing. It was so when it was
// seen first: what a tap tells afterwards may be older, or of later.
void Watcher::look_at_pages() {
  if (memory_ == nullptr) return;  // another daemon has come, and was busy
  find_ids();
  Batch batch;
  for (auto& [source, watched] : sources_) {
    const TapReader* const tap = watched.tap.get();
    const ActivityWord word = page_word(watched.id);
    const auto polled = tap == nullptr ? TapReader::Polled{} : tap->polled();
    if (polled.is_live || word != watched.seen) watched.polls = polled.polls;
    if (word != watched.seen || watched.seen_at == 0) watched.seen_at = shm::monotonic_now();
    watched.seen = word;
    if (polled.is_live) continue;
    const bool is_new = word != watched.reported && (tap == nullptr || word != tap->told());
    // One poll may have been under way, but the next has begun behind the look. Of a source that
    // cannot be tapped nobody else tells.
    const bool is_sure = tap == nullptr || polled.polls >= watched.polls + 2;
    if (!is_new || !is_sure) continue;
    add_page_state(source, word, watched.seen_at, batch);
    watched.reported = word;
  }
  if (!batch.records.empty()) push(std::move(batch));
}

}  // namespace arbiter::recorder
