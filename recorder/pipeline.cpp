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

// By which records are ordered. What a publisher says of its source counts for the last arrival:
// where some were lost, one that is later than all that has been told.
Nanoseconds key_of(const Record& record) {
  if (const auto* state = std::get_if<evidence::SourceState>(&record)) {
    return state->why == evidence::SourceState::Why::page ? state->seen : state->time;
  }
  if (std::holds_alternative<evidence::DestinationsChange>(record)) return 0;
  return evidence::time_of(record);
}

}  // namespace

void TimeOrder::add(RecordPtr record, Nanoseconds now) {
  Nanoseconds key = std::min(key_of(*record), now);
  if (const auto* context = evidence::context_of(*record)) {
    Nanoseconds& last = last_[context->source];
    key = last = std::max(last, key);
  }
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
      thread_([this] { run(); }) {}

void Pipeline::run() {
  try {
    work();
  } catch (...) {
    error_ = std::current_exception();
    failed_();
    while (!queue_.is_over()) static_cast<void>(queue_.pop(kTick));  // so that nobody fills it
  }
}

void Pipeline::work() {
  while (!queue_.is_over()) {
    if (auto batch = queue_.pop(kTick)) take(std::move(*batch));
    sink_.tick(shm::monotonic_now(), horizon_);
  }
  order_.take_before(shm::kForever, [this](const RecordPtr& record) { pass_on(record); });
  sink_.finish(horizon_);
}

void Pipeline::take(Batch&& batch) {
  if (batch.is_start) {
    order_.take_before(shm::kForever, [this](const RecordPtr& record) { pass_on(record); });
    for (const RecordPtr& record : batch.records) pass_on(record);
    return;
  }
  const Nanoseconds now = shm::monotonic_now();
  for (RecordPtr& record : batch.records) order_.add(std::move(record), now);
  order_.take_before(batch.horizon, [this](const RecordPtr& record) { pass_on(record); });
  if (batch.horizon == 0) return;
  horizon_ = batch.horizon;
  winners_.advance(batch.horizon - 1);  // what ends without an event
  for (const RecordPtr& change : std::exchange(changes_, {})) sink_.write(change);
}

// Winners change behind what has changed them.
void Pipeline::pass_on(const RecordPtr& record) {
  const Nanoseconds time = std::min(key_of(*record), shm::monotonic_now());
  if (time != 0) winners_.advance(time - 1);
  for (const RecordPtr& change : std::exchange(changes_, {})) sink_.write(change);
  sink_.write(record);
  follow(*record);
  for (const RecordPtr& change : std::exchange(changes_, {})) sink_.write(change);
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
    winners_.apply(state->context->source, state->word, state->time, Why::state);
  } else if (const auto* model = std::get_if<evidence::ModelChange>(&record)) {
    winners_.set_rules(model->table, model->generation, model->time);
  }
}

void Pipeline::join() {
  if (thread_.joinable()) thread_.join();
}

void Pipeline::finish() {
  join();
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

}  // namespace arbiter::recorder
