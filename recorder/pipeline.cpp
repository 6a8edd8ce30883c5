#include "recorder/pipeline.hpp"

#include <algorithm>
#include <utility>

#include "shm/clock.hpp"

namespace arbiter::recorder {
namespace {

using evidence::WinnerChange;
using Why = WinnerChange::Why;

// How long the thread sleeps where nothing comes.
constexpr std::chrono::milliseconds kTick{100};
// What comes late: the first arrivals of a component, until its tap reaches it, and models, until
// they are noticed. The rest waits for these, once or twice as long, unless it takes too much
// memory.
constexpr Nanoseconds kWaitForLate = 200'000'000;
constexpr std::size_t kMostHeldBack = std::size_t{16} << 20;

// By which records are ordered. What a publisher says of its source counts for the last arrival:
// where some were lost, one that is later than all that has been told. Where nobody has told yet,
// an operator may have deactivated the source: when, its page says.
Nanoseconds key_of(const Record& record) {
  if (const auto* state = std::get_if<evidence::SourceState>(&record)) {
    const bool is_page = state->why == evidence::SourceState::Why::page;
    const bool is_joined = state->why == evidence::SourceState::Why::joined;
    if ((is_page || is_joined) && shm::is_deactivation(state->word)) {
      return shm::time_of(state->word, shm::kForever);
    }
    return is_page ? state->seen : state->time;
  }
  if (std::holds_alternative<evidence::DestinationsChange>(record)) return 0;
  return evidence::time_of(record);
}

}  // namespace

// A page may be read before the tap tells of what was before.
void TimeOrder::add(RecordPtr record, Nanoseconds now) {
  Nanoseconds key = std::min(key_of(*record), now);
  const auto* state = std::get_if<evidence::SourceState>(record.get());
  const bool is_page = state != nullptr && state->why == evidence::SourceState::Why::page;
  if (const auto* context = evidence::context_of(*record); context != nullptr && !is_page) {
    Nanoseconds& last = last_[context->source];
    key = last = std::max(last, key);
  }
  bytes_ += evidence::size_of(*record);
  waiting_.push({key, number_++, std::move(record)});
}

Pipeline::Pipeline(RecordQueue& queue, Sink& sink, std::function<void()> failed)
    : queue_(queue),
      sink_(sink),
      failed_(std::move(failed)),
      winners_([this](WinnerChange&& change) {
        ++winner_changes_;
        changes_.push_back(std::make_shared<const Record>(std::move(change)));
      }),
      ended_(std::async(std::launch::async, [this] { run(); })) {}

void Pipeline::run() {
  try {
    work();
  } catch (...) {
    failed_();
    while (!queue_.is_over()) static_cast<void>(queue_.pop(kTick));  // so that nobody fills it
    throw;
  }
}

void Pipeline::work() {
  while (!queue_.is_over()) {
    if (auto batch = queue_.pop(kTick)) take(std::move(*batch));
    sink_.tick(shm::monotonic_now(), horizon_);
  }
  pass_on_before(newest_, shm::kForever);
  sink_.finish(newest_);
}

void Pipeline::take(Batch&& batch) {
  if (batch.is_start) {
    pass_on_before(newest_, shm::kForever);
    for (const RecordPtr& record : batch.records) pass_on(record);
    return;
  }
  const Nanoseconds now = shm::monotonic_now();
  for (RecordPtr& record : batch.records) order_.add(std::move(record), now);
  newest_ = std::max(newest_, batch.horizon);
  if (order_.bytes() > kMostHeldBack) {
    horizon_ = next_ = newest_;
  } else if (now - noted_ >= kWaitForLate) {
    noted_ = now;
    horizon_ = std::exchange(next_, newest_);
  }
  pass_on_before(horizon_, horizon_);
}

// `known`: what ends before it without an event has ended.
void Pipeline::pass_on_before(Nanoseconds known, Nanoseconds horizon) {
  order_.take_before(horizon, [this](const RecordPtr& record) { pass_on(record); });
  if (known != 0) advance(known - 1);
}

void Pipeline::advance(Nanoseconds time) {
  winners_.advance(time);
  write_changes();
}

void Pipeline::write_changes() {
  for (const RecordPtr& change : std::exchange(changes_, {})) sink_.write(change);
}

// Winners change behind what has changed them.
void Pipeline::pass_on(const RecordPtr& record) {
  const Nanoseconds time = std::min(key_of(*record), shm::monotonic_now());
  if (time != 0) advance(time - 1);
  sink_.write(record);
  follow(*record);
  write_changes();
}

void Pipeline::follow(const Record& record) {
  if (const auto* start = std::get_if<evidence::Start>(&record)) {
    winners_.start(start->time);
  } else if (const auto* arrival = std::get_if<evidence::Arrival>(&record)) {
    winners_.apply(arrival->context->source, arrival->word, arrival->time, Why::arrival);
  } else if (const auto* over = std::get_if<evidence::Deactivation>(&record)) {
    winners_.apply(over->context->source, shm::deactivation(over->time), over->time,
                   Why::deactivation);
  } else if (const auto* state = std::get_if<evidence::SourceState>(&record)) {
    switch (state->why) {
      case evidence::SourceState::Why::page:
        winners_.read(state->context->source, state->word);
        break;
      case evidence::SourceState::Why::joined:
        if (state->lost == 0) {
          winners_.join(state->context->source, state->word);
          break;
        }
        [[fallthrough]];  // of its last arrival nobody else tells
      case evidence::SourceState::Why::gap:
      case evidence::SourceState::Why::closed:
        winners_.apply(state->context->source, state->word, state->time, Why::state);
    }
  } else if (const auto* model = std::get_if<evidence::ModelChange>(&record)) {
    winners_.set_rules(model->table, model->generation, model->time);
  } else if (const auto* missed = std::get_if<evidence::Missed>(&record)) {
    lost_events_ += missed->events;
    lost_samples_ += missed->samples;
  }
}

}  // namespace arbiter::recorder
