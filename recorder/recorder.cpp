#include "recorder/recorder.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "recorder/sleep.hpp"
#include "shm/clock.hpp"

namespace arbiter::recorder {
namespace {

// How long the writer may go without being told the time.
constexpr Nanoseconds kPushEvery = 20'000'000;
// Until whoever waits for the end is told why there is none.
constexpr std::chrono::seconds kPatience{1};

}  // namespace

Recorder::Recorder(const RecorderOptions& options, Sink& sink)
    : options_(options),
      watcher_(options, queue_),
      failed_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      pipeline_(queue_, sink, [this] { eventfd_write(failed_.get(), 1); }),
      started_(shm::monotonic_now()) {
  static_cast<void>(take_new_taps());
  watcher_.start();
}

Recorder::~Recorder() {
  watcher_.stop();
  queue_.close();
}

// By absolute times: a round that takes long is not made up for.
void Recorder::run(Nanoseconds end, int events, const std::function<bool()>& goes_on) {
  Nanoseconds next = shm::monotonic_now();
  while (next < end) {
    poll_taps();
    next = std::max(next + options_.period, shm::monotonic_now() + options_.period / 10);
    if (!sleep_until(std::min(next, end), {events, failed_.get()})) continue;
    eventfd_t failed = 0;
    if (eventfd_read(failed_.get(), &failed) == 0 || !goes_on()) break;
  }
  poll_taps();
}

std::vector<std::shared_ptr<TapReader>> Recorder::take_new_taps() {
  Watcher::NewTaps fresh = watcher_.take_taps([this] { forget_taps(); });
  for (auto& tap : fresh.taps) taps_.push_back(std::move(tap));
  return std::move(fresh.over);
}

// What happened before the last round began has come with this one, but for publishers that were
// stopped in between.
void Recorder::poll_taps() {
  const auto over = take_new_taps();
  const Nanoseconds now = shm::monotonic_now();
  Backlog backlog{queue_.waiting(), options_.queue_bytes};
  Batch batch;
  bool ports_changed = false;
  for (const auto& tap : taps_) {
    ports_changed = tap->poll(backlog, batch.records) || ports_changed;
  }
  for (const auto& tap : over) {
    tap->finish(batch.records);
    count(*tap);
    std::erase(taps_, tap);
  }
  if (ports_changed) watcher_.note_ports_changed();
  batch.horizon = std::exchange(last_poll_, now);
  if (batch.records.empty() && now - last_push_ < kPushEvery) return;
  last_push_ = now;
  queue_.push(std::move(batch));
}

void Recorder::count(const TapReader& tap) {
  recorded_.arrivals += tap.arrivals();
  if (tap.arrivals() != 0) heard_.note(tap.name());
}

void Recorder::forget_taps() {
  Batch batch;
  for (const auto& tap : taps_) {
    tap->finish(batch.records);
    count(*tap);
  }
  taps_.clear();
  queue_.push(std::move(batch));
}

Recorded Recorder::finish() {
  watcher_.stop();
  watcher_.look_once_more();
  last_push_ = 0;  // nothing new is news: that it has been recorded until now
  poll_taps();     // those too that it has opened since
  poll_taps();     // the watcher believes a page after two
  watcher_.look_at_pages();
  forget_taps();
  queue_.close();
  if (!pipeline_.ends_within(kPatience)) {
    options_.say("still writing, for the disk is slow; `kill -9 " + std::to_string(::getpid()) +
                 "` gives up what is not written yet");
  }
  pipeline_.finish();
  recorded_.sources = heard_.count();
  recorded_.winner_changes = pipeline_.winner_changes();
  recorded_.lost_events = pipeline_.lost_events();
  recorded_.lost_samples = pipeline_.lost_samples();
  recorded_.time = shm::monotonic_now() - started_;
  return recorded_;
}

}  // namespace arbiter::recorder
