// What the daemon is asked for: which ports are open, and which sources are no more.
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "recorder/watcher.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"

namespace arbiter::recorder {
namespace {

// How often the daemon is asked for its ports: where a tap has told that they have changed, and
// otherwise, for input ports that no tap tells of.
constexpr Nanoseconds kPortsAtMostEvery = 200'000'000;
constexpr Nanoseconds kPortsAtLeastEvery = 2'000'000'000;

}  // namespace

// What it alone knows. A policy may come into force that keeps us from asking.
void Watcher::ask_daemon() {
  const Nanoseconds now = shm::monotonic_now();
  if (!instance_->has_daemon() || now < next_question_) return;
  try {
    if (memory_->tables().generation() != generation_) take_up_model();
    look_at_ports();
    if (std::exchange(may_not_observe_, false)) options_.say("the daemon tells again");
  } catch (const wire::RefusedError& error) {
    last_ports_ = 0;
    next_question_ = now + kPortsAtLeastEvery;
    if (std::exchange(may_not_observe_, true)) return;
    options_.say(std::string("what is new of models, sources and ports may be missing in the "
                             "recording, for the daemon refuses to tell; it is tried again: ") +
                 error.what());
  }
}

void Watcher::look_at_ports() {
  const Nanoseconds now = shm::monotonic_now();
  const bool is_due =
      !ports_.is_known() || now - last_ports_ >= kPortsAtLeastEvery ||
      (now - last_ports_ >= kPortsAtMostEvery && ports_changed_.load(std::memory_order_relaxed));
  if (!is_due || !instance_->has_daemon()) return;
  ports_changed_.store(false, std::memory_order_relaxed);
  last_ports_ = now;
  const wire::Status status = instance_->status();
  if (instance_->memory() != memory_) return;  // another daemon has answered: begin again
  Batch batch;
  ports_.note(status, shm::monotonic_now(), batch);
  note_strangers(status.strangers, batch);
  if (!batch.records.empty()) push(std::move(batch));
  forget_gone(status);
}

// They go on by the memory of a daemon before, where nothing of this run is: who obeys them does,
// and no tap of this memory tells of it.
void Watcher::note_strangers(const std::vector<wire::StrangerStatus>& strangers, Batch& batch) {
  for (const wire::StrangerStatus& stranger : strangers) {
    const std::string component = stranger.node + " (pid " + std::to_string(stranger.pid) + ")";
    std::vector<std::string> unrecorded;
    for (const std::string& source : stranger.outputs) {
      const bool is_recorded = options_.ports.empty() || sources_.count(source) != 0;
      if (!is_recorded || !strangers_.insert({source, stranger.pid}).second) continue;
      unrecorded.push_back(source);
      batch.add(evidence::Missed{
          source, begun_, shm::monotonic_now(), 0, 0, evidence::Missed::Why::stranger,
          "of component " + component + ", which this daemon does not know"});
    }
    if (unrecorded.empty()) continue;
    options_.say("cannot record " + rules::enumerate(unrecorded) + " of component " + component +
                 ": it goes on by the memory of a daemon before, and this one does not know it; "
                 "start it again");
  }
}

// Where all sources are recorded; of chosen ports, only models say which.
void Watcher::forget_gone(const wire::Status& status) {
  if (!options_.ports.empty()) return;
  std::set<std::string_view> there(named_.begin(), named_.end());
  for (const wire::SourceStatus& each : status.sources) there.insert(each.name);
  over_.clear();
  std::erase_if(sources_, [&](const auto& each) {
    const auto& [source, watched] = each;
    const bool is_open = watched.tap != nullptr && watched.tap->polled().is_live;
    // With another id it has come again since; with a page that is not here yet, the id is that of
    // another source.
    const auto id = watched.id;
    const auto number = id ? memory_->tables().pages().of(*id) : shm::PageNumber{};
    const bool may_be_back =
        id != instance_->find_source(source) || (id && !memory_->pages().has(*id, number));
    if (there.contains(source) || is_open || may_be_back) return false;
    if (id) gone_[*id] = number;
    if (watched.tap != nullptr) over_.push_back(watched.tap);
    return true;
  });
  const std::lock_guard lock(mutex_);
  new_taps_.over.insert(new_taps_.over.end(), over_.begin(), over_.end());
}

}  // namespace arbiter::recorder
