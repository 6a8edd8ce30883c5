#include "recorder/tap_reader.hpp"

#include <algorithm>
#include <utility>

#include "shm/clock.hpp"
#include "shm/limits.hpp"

namespace arbiter::recorder {
namespace {

using evidence::ActivityWord;
using evidence::Arrival;
using evidence::ContextPtr;
using evidence::Missed;
using evidence::SourceContext;
using evidence::SourceState;

// A source that publishes flat out leaves the others their turn.
constexpr int kMostEvents = 2048;

Nanoseconds ns(Time time) { return time.time_since_epoch().count(); }

// What a predecessor has left may be older than all that this publisher has told. A time that has
// not come is made up.
ActivityWord word_of(const TapEvent<>& event) {
  if (const auto until = event.active_until()) return ns(*until);
  const auto since = event.stands_since();
  if (!since) return shm::kNeverActive;
  const Nanoseconds time = std::min(ns(*since), shm::monotonic_now());
  return event.is_deactivated() ? shm::deactivation(time) : shm::kForeverFlag | time;
}

bool is_same(const SourceContext& context, const TapEvent<>& event,
             const std::vector<TapDestination>& destinations) {
  return context.type == event.type().name() && context.size == event.type().size() &&
         context.alignment == event.type().alignment() &&
         std::equal(context.destinations.begin(), context.destinations.end(), destinations.begin(),
                    destinations.end(), [](const std::string& name, const TapDestination& each) {
                      return name == each.port;
                    });
}

shm::Masks masks_of(const std::vector<TapDestination>& destinations) {
  shm::Masks masks;
  for (std::size_t i = 0; i < destinations.size() && i < shm::kMaxDestinations; ++i) {
    const std::uint64_t bit = std::uint64_t{1} << i;
    switch (destinations[i].fate) {
      case Fate::accepted:
        masks.accepted |= bit;
        break;
      case Fate::discarded:
        masks.discarded |= bit;
        break;
      case Fate::refused:
        masks.refused |= bit;
        break;
      case Fate::blind:
        masks.blind |= bit;
        break;
      case Fate::none:
        break;
    }
  }
  return masks;
}

template <class T>
void add(std::vector<RecordPtr>& records, T record) {
  records.push_back(std::make_shared<const Record>(std::move(record)));
}

}  // namespace

bool TapReader::poll(Backlog& backlog, std::vector<RecordPtr>& records) {
  std::size_t counted = records.size();
  const auto count = [&] {
    for (; counted < records.size(); ++counted) backlog.waiting.add(*records[counted]);
  };
  bool ports_changed = false;
  auto [polls, is_live] = polled();
  if (backlog.room() != Room::none) tell_left_out(records);
  count();
  for (int i = 0; i < kMostEvents; ++i) {
    const auto event = tap_.take();
    if (!event) break;
    const TapEventKind kind = event->kind();
    ports_changed = ports_changed || kind == TapEventKind::state || kind == TapEventKind::closed ||
                    kind == TapEventKind::destinations;
    take(*event, backlog, records);
    count();
    last_ = std::max(last_, ns(event->time()));
    is_live = kind != TapEventKind::closed;
    told_.store(word_of(*event), std::memory_order_relaxed);
  }
  polled_.store((polls + 1) * 2 + (is_live ? 1 : 0), std::memory_order_relaxed);
  return ports_changed;
}

// The clock is read once the event has come: what it tells has happened by then.
void TapReader::take(const TapEvent<>& event, const Backlog& backlog,
                     std::vector<RecordPtr>& records) {
  const Nanoseconds seen = shm::monotonic_now();
  if (backlog.room() == Room::none) {
    leave_out(event, seen);
    return;
  }
  switch (event.kind()) {
    case TapEventKind::sample:
    case TapEventKind::signal:
      add_arrival(event, seen, backlog, records);
      break;
    case TapEventKind::deactivation:
      add(records, evidence::Deactivation{context_of(event), ns(event.time()), seen,
                                          event.sequence(), event.generation()});
      break;
    case TapEventKind::destinations:
      add(records, evidence::DestinationsChange{context_of(event), ns(event.time()), seen});
      break;
    case TapEventKind::state:
    case TapEventKind::closed:
      add_state(event, seen, records);
      break;
    case TapEventKind::dropped:
    case TapEventKind::overtaken:
      break;  // these are told to taps of input ports only
  }
}

void TapReader::add_state(const TapEvent<>& event, Nanoseconds seen,
                          std::vector<RecordPtr>& records) {
  SourceState state;
  state.context = context_of(event);
  state.time = ns(event.time());
  state.seen = seen;
  state.why = event.kind() == TapEventKind::closed ? SourceState::Why::closed
              : event.lost() != 0                  ? SourceState::Why::gap
                                                   : SourceState::Why::joined;
  state.sequence = event.sequence();
  state.generation = event.generation();
  state.lost = event.lost();
  state.word = word_of(event);
  if (state.lost != 0) {
    add(records, Missed{state.context->source, last_, std::max(last_, state.time), state.lost, 0,
                        Missed::Why::overtaken, ""});
  }
  // It had not been told of the tap, as where it began beside a daemon that had just taken over.
  const Nanoseconds heard = std::max(last_, opened_);
  if (state.why == SourceState::Why::joined && state.time > heard) {
    state.lost = 1;
    add(records,
        Missed{state.context->source, heard, seen, 1, 0, Missed::Why::overtaken, kUnknownNumber});
  }
  add(records, std::move(state));
}

void TapReader::add_arrival(const TapEvent<>& event, Nanoseconds seen, const Backlog& backlog,
                            std::vector<RecordPtr>& records) {
  Arrival arrival;
  const auto destinations = event.destinations();
  arrival.context = context_of(event);
  arrival.time = ns(event.time());
  arrival.seen = std::max(seen, arrival.time);
  arrival.is_sample = event.kind() == TapEventKind::sample;
  arrival.sequence = event.sequence();
  arrival.size = arrival.is_sample ? event.size() : 0;
  arrival.generation = event.generation();
  arrival.word = word_of(event);
  arrival.masks = masks_of(destinations);
  arrival.origin = {event.origin().publisher, event.origin().sequence};
  ++arrivals_;
  if (with_payloads_ && arrival.is_sample) {
    if (const auto why = take_payload(event, backlog, arrival)) {
      add(records, Missed{arrival.context->source, arrival.time, arrival.time, 0, 1, *why, ""});
    }
  }
  add(records, std::move(arrival));
}

// Nothing, or why it is left out.
std::optional<Missed::Why> TapReader::take_payload(const TapEvent<>& event, const Backlog& backlog,
                                                   Arrival& arrival) const {
  const auto bytes = event.sample();
  if (!bytes) return Missed::Why::overtaken;
  if (bytes->size() > most_payload_) return Missed::Why::too_large;
  if (!backlog.has_room_for(bytes->size())) return Missed::Why::queue;
  arrival.payload.emplace(bytes->begin(), bytes->end());
  return std::nullopt;
}

void TapReader::leave_out(const TapEvent<>& event, Nanoseconds seen) {
  if (!left_out_) {
    left_out_.emplace();
    left_out_->from = event.lost() != 0 ? last_ : ns(event.time());
  }
  LeftOut& out = *left_out_;
  out.to = ns(event.time());
  out.events += event.lost();
  const bool is_event = event.kind() == TapEventKind::sample ||
                        event.kind() == TapEventKind::signal ||
                        event.kind() == TapEventKind::deactivation;
  if (is_event) ++out.events;
  out.last.context = context_of(event);
  out.last.time = ns(event.time());
  out.last.seen = seen;
  out.last.why =
      event.kind() == TapEventKind::closed ? SourceState::Why::closed : SourceState::Why::gap;
  out.last.sequence = event.sequence();
  out.last.generation = event.generation();
  out.last.word = word_of(event);
}

void TapReader::tell_left_out(std::vector<RecordPtr>& records) {
  if (!left_out_) return;
  LeftOut out = std::move(*left_out_);
  left_out_.reset();
  out.last.lost = out.events;
  add(records,
      Missed{out.last.context->source, out.from, out.to, out.events, 0, Missed::Why::queue, ""});
  add(records, std::move(out.last));
}

void TapReader::finish(std::vector<RecordPtr>& records) { tell_left_out(records); }

const ContextPtr& TapReader::context_of(const TapEvent<>& event) {
  const auto destinations = event.destinations();
  if (context_ != nullptr && is_same(*context_, event, destinations)) return context_;
  auto context = std::make_shared<SourceContext>();
  context->source = event.source();
  context->is_described = true;
  context->type = event.type().name();
  context->size = event.type().size();
  context->alignment = event.type().alignment();
  for (const TapDestination& each : destinations) {
    if (context->destinations.size() < shm::kMaxDestinations) {
      context->destinations.emplace_back(each.port);
    }
  }
  context_ = std::move(context);
  return context_;
}

}  // namespace arbiter::recorder
