#include "recorder/ring.hpp"

#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "recording/directory.hpp"
#include "shm/clock.hpp"
#include "shm/limits.hpp"

namespace arbiter::recorder {
namespace {

using evidence::Missed;
using evidence::PortChange;
using evidence::SourceState;

// Of the requests for one cause.
constexpr std::size_t kMostWaiting = 64;
// What is written of its own accord rests for as long, or for half of the span that is kept: so
// nothing is missed.
constexpr Nanoseconds kMostRest = 10'000'000'000;
// Of its own files, where the disk is full: what fills it may be somebody else's.
constexpr std::size_t kMostRemovedForRoom = 4;

bool is_of_own_accord(Cause cause) { return cause == Cause::when || cause == Cause::death; }

// What a file may be without, so that what it has reaches back further.
struct Shares {
  std::size_t payloads;  // of the memory: beyond it, they give way before records do
  std::size_t payload;   // one that has more would leave no room for others'
};
Shares shares_of(std::size_t memory) { return {memory / 2, memory / 4}; }

RecordPtr bare(const Record& arrival) {
  return std::make_shared<const Record>(
      evidence::without_payload(std::get<evidence::Arrival>(arrival)));
}

SourceState state_of(const evidence::ContextPtr& context, Nanoseconds time, Nanoseconds seen,
                     std::uint64_t sequence, std::uint64_t generation,
                     evidence::ActivityWord word) {
  SourceState state;
  state.context = context;
  state.time = time;
  state.seen = seen;
  state.sequence = sequence;
  state.generation = generation;
  state.word = word;
  return state;
}

}  // namespace

std::string_view name_of(Cause cause) {
  switch (cause) {
    case Cause::asked:
      return "asked";
    case Cause::signal:
      return "signal";
    case Cause::when:
      return "when";
    case Cause::death:
      break;
  }
  return "death";
}

// Each has a number of its own, so that an answer belongs to who has asked; those that are due
// together share a file. Where very many wait, the last waits for the next as well.
std::uint64_t Ring::request(Cause cause) {
  const std::lock_guard lock(mutex_);
  std::size_t waiting = 0;
  Request* last = nullptr;
  for (Request& request : requests_) {
    if (request.cause != cause) continue;
    ++waiting;
    last = &request;
  }
  if (waiting == kMostWaiting) {
    last->time = shm::monotonic_now();
    return last->number;
  }
  requests_.push_back({++requested_, cause, shm::monotonic_now()});
  return requested_;
}

void Ring::write(const RecordPtr& record) {
  add(record);
  // A time in the future is no reason to forget what is kept.
  const Nanoseconds newest = std::min(evidence::time_of(*record), shm::monotonic_now());
  while (!records_.empty() &&
         evidence::time_of(*records_.front().record) < newest - options_.span) {
    forget_oldest();
  }
  make_room();
  const auto* port = std::get_if<PortChange>(&*record);
  if (options_.on_death && port != nullptr && port->what == PortChange::What::died) {
    request(Cause::death);
  }
}

void Ring::add(const RecordPtr& record) {
  const std::size_t payload = evidence::payload_size_of(*record);
  if (payload > shares_of(options_.memory).payload) {
    records_.push_back({bare(*record), true});
  } else {
    if (payload != 0) payloads_.push_back(forgotten_ + records_.size());
    payload_bytes_ += payload;
    records_.push_back({record, false});
  }
  bytes_ += evidence::size_of(*records_.back().record);
}

void Ring::make_room() {
  while (bytes_ > options_.memory) {
    if (payload_bytes_ > shares_of(options_.memory).payloads) {
      drop_oldest_payload();
    } else {
      forget_oldest();
    }
  }
}

void Ring::forget_oldest() {
  const RecordPtr record = std::move(records_.front().record);
  records_.pop_front();
  if (!payloads_.empty() && payloads_.front() == forgotten_) payloads_.pop_front();
  ++forgotten_;
  bytes_ -= evidence::size_of(*record);
  payload_bytes_ -= evidence::payload_size_of(*record);
  sum_up(*record);
}

void Ring::drop_oldest_payload() {
  Kept& kept = records_[payloads_.front() - forgotten_];
  payloads_.pop_front();
  const std::size_t payload = evidence::payload_size_of(*kept.record);
  kept = {bare(*kept.record), true};
  bytes_ -= payload;
  payload_bytes_ -= payload;
}

// The file begins when the last of what is summed up has happened, or was heard of: all of it was
// so then.
void Ring::sum_up(const Record& record) {
  base_time_ = std::max(base_time_, std::min(evidence::time_of(record), shm::monotonic_now()));
  const auto note = [this](SourceState state) {
    base_time_ = std::max(base_time_, state.seen);
    sources_.insert_or_assign(state.context->source, std::move(state));
    if (sources_.size() > shm::kMaxSources) forget_sources();
  };
  if (const auto* start = std::get_if<evidence::Start>(&record)) {
    start_ = *start;
    base_time_ = start->time;
    sources_.clear();
    untapped_.clear();
    winners_.clear();
    ports_.clear();
    model_.reset();
  } else if (const auto* arrival = std::get_if<evidence::Arrival>(&record)) {
    note(state_of(arrival->context, arrival->time, arrival->seen, arrival->sequence,
                  arrival->generation, arrival->word));
  } else if (const auto* over = std::get_if<evidence::Deactivation>(&record)) {
    const auto known = sources_.find(over->context->source);
    note(state_of(over->context, over->time, over->seen, over->sequence, over->generation,
                  known == sources_.end() ? shm::deactivation(over->time)
                                          : shm::deactivated(known->second.word, over->time)));
  } else if (const auto* state = std::get_if<SourceState>(&record)) {
    if (state->why != SourceState::Why::page) {  // its publisher tells of it now
      for (const auto why : {Missed::Why::refused, Missed::Why::stranger}) {
        untapped_.erase({state->context->source, why});
      }
    }
    note(state_of(state->context, state->time, state->seen, state->sequence, state->generation,
                  state->word));
  } else if (const auto* change = std::get_if<evidence::DestinationsChange>(&record)) {
    const auto known = sources_.find(change->context->source);
    if (known != sources_.end()) known->second.context = change->context;
  } else if (const auto* model = std::get_if<evidence::ModelChange>(&record)) {
    model_ = *model;
  } else if (const auto* port = std::get_if<PortChange>(&record)) {
    const std::pair key(port->is_input, port->port);
    const bool is_open =
        port->what == PortChange::What::open || port->what == PortChange::What::opened;
    if (is_open) {
      ports_.insert_or_assign(key, *port).first->second.what = PortChange::What::open;
    } else {
      ports_.erase(key);
    }
  } else if (const auto* winner = std::get_if<evidence::WinnerChange>(&record)) {
    auto& kept = winners_.insert_or_assign(winner->port, *winner).first->second;
    kept.why = evidence::WinnerChange::Why::start;
    kept.by.clear();
    if (winner->winner.empty()) winners_.erase(winner->port);
  } else if (const auto* missed = std::get_if<Missed>(&record)) {
    const bool is_untapped =
        missed->why == Missed::Why::refused || missed->why == Missed::Why::stranger;
    if (is_untapped) untapped_[{missed->source, missed->why}] = *missed;
  }
}

// More than there can be at a time: names have come and gone. Those that the model does not read,
// and that are not active, are not needed to begin with.
void Ring::forget_sources() {
  const auto* const rules = model_ ? model_->table.get() : nullptr;
  std::erase_if(sources_, [&](const auto& each) {
    const bool is_read = rules != nullptr && rules->source(each.first) != shm::kNone;
    return !is_read && !shm::is_active(each.second.word, base_time_);
  });
}

void Ring::finish(Nanoseconds horizon) {
  horizon_ = horizon;
  is_ending_ = true;
  write_due(shm::monotonic_now());
}

void Ring::tick(Nanoseconds now, Nanoseconds horizon) {
  horizon_ = horizon;
  write_due(now);
}

bool Ring::is_due(const Request& request, Nanoseconds now) const {
  if (is_ending_) return true;
  if (request.time > horizon_) return false;
  if (!is_of_own_accord(request.cause)) return true;
  if (is_resting(request.cause, now)) return false;
  const Nanoseconds after = std::min(options_.after, options_.span / 2);
  const bool is_losing_what_led_to_it = forgotten_ != 0 && base_time_ > request.time - after;
  return horizon_ - request.time >= after || is_losing_what_led_to_it;
}

bool Ring::is_resting(Cause cause, Nanoseconds now) const {
  const auto last = written_at_.find(cause);
  return last != written_at_.end() && now - last->second < std::min(kMostRest, options_.span / 2);
}

void Ring::write_due(Nanoseconds now) {
  std::map<Cause, std::vector<std::uint64_t>> due;
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(requests_, [&](const Request& request) {
      if (!is_due(request, now)) return false;
      due[request.cause].push_back(request.number);
      return true;
    });
  }
  for (auto& [cause, requests] : due) {
    if (is_of_own_accord(cause)) written_at_[cause] = now;
    dump(cause, std::move(requests));
  }
}

// What goes wrong with one file, such as a full disk, must not end the recording.
void Ring::dump(Cause cause, std::vector<std::uint64_t> requests) {
  Dumped dumped;
  dumped.requests = std::move(requests);
  while (dumped.file.empty() && dumped.error.empty()) {
    try {
      dumped.file = write_file(cause);
      ++dumps_;
      if (!is_of_own_accord(cause)) break;
      for (std::string& each : own_files_.add(dumped.file)) {
        dumped.removed.push_back(std::move(each));
      }
    } catch (const recording::NoRoomError& error) {
      const bool may_remove = dumped.removed.size() < kMostRemovedForRoom;
      std::string removed = may_remove ? own_files_.remove_oldest() : "";
      if (removed.empty()) {
        dumped.error = error.what();
      } else {
        dumped.removed.push_back(std::move(removed));
      }
    } catch (const std::exception& error) {
      dumped.error = error.what();
    }
  }
  options_.told(dumped);
}

// Returns its name.
std::string Ring::write_file(Cause cause) const {
  const std::string part = options_.prefix + ".part";
  recording::McapOptions options = options_.file;
  options.unfinished = recording::Unfinished::discard;
  evidence::RecordingInfo info = options_.info;
  info.wall_offset = options_.wall_offset();
  ::unlink(part.c_str());  // of a recorder that was killed
  try {
    evidence::RecordWriter writer(part, options, info);
    write_base(writer);
    write_records(writer);
    writer.close(horizon_);
    return give_name(part, cause, info.wall_offset);
  } catch (...) {
    ::unlink(part.c_str());
    throw;
  }
}

// What had to give way of a source is told once, with the last arrival that lacks it.
void Ring::write_records(evidence::RecordWriter& writer) const {
  std::map<std::string, Missed> missed;
  for (const Kept& kept : records_) {
    if (!kept.lacks_payload) continue;
    const auto& arrival = std::get<evidence::Arrival>(*kept.record);
    const std::string& source = arrival.context->source;
    const auto all = missed
                         .try_emplace(source, evidence::Missed{source, arrival.time, arrival.time,
                                                               0, 0, Missed::Why::memory, ""})
                         .first;
    all->second.to = std::max(all->second.to, arrival.time);
    ++all->second.samples;
  }
  std::map<std::string, std::uint64_t> passed;
  for (const Kept& kept : records_) {
    writer.write(*kept.record);
    if (!kept.lacks_payload) continue;
    const std::string& source = evidence::context_of(*kept.record)->source;
    const Missed& all = missed.at(source);
    if (++passed[source] == all.samples) writer.write(all);
  }
}

// As a recording begins: its start, the states, the model.
void Ring::write_base(evidence::RecordWriter& writer) const {
  if (!start_) return;  // it is among the records
  evidence::Start start = *start_;
  start.time = base_time_;
  writer.write(start);
  for (const auto& [source, state] : sources_) writer.write(state);
  for (const auto& [source, missed] : untapped_) writer.write(missed);
  if (model_) writer.write(*model_);
  for (const auto& [key, port] : ports_) writer.write(port);
  for (const auto& [port, winner] : winners_) writer.write(winner);
}

// Under its name there is a whole file, or none.
std::string Ring::give_name(const std::string& written, Cause cause,
                            std::int64_t wall_offset) const {
  const std::time_t now = (shm::monotonic_now() + wall_offset) / 1'000'000'000;
  std::tm parts{};
  gmtime_r(&now, &parts);
  char stamp[32];
  std::strftime(stamp, sizeof stamp, "-%Y%m%dT%H%M%SZ-", &parts);
  const std::string path = (options_.prefix + stamp).append(name_of(cause));
  std::string name = path + ".mcap";
  for (int i = 2; !recording::move_to_new(written, name); ++i) {
    name = path + "-" + std::to_string(i) + ".mcap";
  }
  return name;
}

}  // namespace arbiter::recorder
