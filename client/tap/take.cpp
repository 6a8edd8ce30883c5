// The tap's thread: take().
//
// Events of one source come in its order. Of several sources that have told something, the one
// whose next event is the oldest comes first. What an input port has dropped comes when that was
// seen.
#include <algorithm>
#include <utility>

#include "client/tap/tap_core.hpp"
#include "shm/utf8.hpp"

namespace arbiter::detail {
namespace {

// How many events that are not for us are passed over in one look.
constexpr int kMaxPassedOver = 64;

constexpr auto kEnd = static_cast<std::uint8_t>(shm::kLastEventKind + 1);  // TapEventKind::closed
constexpr std::uint8_t kDropped = kEnd + 1;
constexpr std::uint8_t kOvertaken = kEnd + 2;

// How often an input port's counters are looked at: each look takes the line in which they lie out
// of the cache of its component, which has to fetch it back.
constexpr shm::Nanoseconds kLookInterval = 1'000'000;
// So many are kept until they are taken; then nothing is looked at.
constexpr std::size_t kMaxTakes = 1024;

// The daemon lets no input port have another name: whoever uses a tap may write names to a terminal
// or into a document.
bool can_be_ports(const shm::Destinations& destinations) {
  return std::all_of(
      destinations.begin(), destinations.end(),
      [](const shm::Destination& destination) { return shm::is_port_name(destination.name); });
}

}  // namespace

void TapCore::accept_view() {
  std::unique_ptr<TapSourceView> view = handover_.accept();
  if (view == nullptr) return;
  std::erase_if(streams_, [&](const Stream& stream) {
    return std::none_of(view->links.begin(), view->links.end(),
                        [&](const TapSourceLink& link) { return link.source == stream.source; });
  });
  for (const TapSourceLink& link : view->links) {
    const auto known = std::find_if(streams_.begin(), streams_.end(), [&](const Stream& stream) {
      return stream.source == link.source;
    });
    if (known != streams_.end()) {
      known->gone = link.gone;
      known->end = link.end;
      if (known->ended && known->gone) let_go(*known);  // it was given up before
      continue;
    }
    Stream stream;
    stream.source = link.source;
    stream.gone = link.gone;
    stream.end = link.end;
    stream.reader =
        shm::EventReader(*link.source->events, link.source->shape, link.source->output->instance,
                         link.source->place, link.source->link);
    streams_.push_back(std::move(stream));
    auto& context = known_[link.source->output->source];
    context =
        std::make_shared<TapContext>(TapContext{link.source->name, link.source->output->type, {}});
  }
  handover_.retire(std::exchange(view_, std::move(view)));
  service_bell_->ring();  // to dispose of the old one
}

// Whatever a publisher writes must not be believed before it is looked at.
bool TapCore::is_honest(const Stream& stream) const noexcept {
  const shm::EventRecord& head = stream.head;
  const auto kind = static_cast<std::uint8_t>(head.kind);
  if (kind == 0 || kind > shm::kLastEventKind) return false;
  return head.kind != shm::EventKind::kSample ||
         shm::slot_of(head.sample) < stream.source->output->segment.layout().slot_count;
}

// No honest publisher tells of what came before the event before it, or is yet to come. The clock
// is read after the event has been, and only where the last reading does not do.
bool TapCore::has_credible_time(const Stream& stream) noexcept {
  const shm::Nanoseconds time = stream.head.time;
  if (time > reading_) reading_ = shm::monotonic_now();
  return time >= stream.last.time && time <= reading_;
}

// Nor of an arrival that has not made its source active, or of a deactivation that has not ended
// that.
bool TapCore::has_credible_activity(const shm::EventRecord& head) noexcept {
  switch (head.kind) {
    case shm::EventKind::kSample:
    case shm::EventKind::kSignal:
      return shm::is_active(head.activity, head.time);
    case shm::EventKind::kDeactivation:
      return shm::is_deactivation(head.activity);
    case shm::EventKind::kState:  // the activity may be one that a predecessor has left
    case shm::EventKind::kDestinations:
      break;
  }
  return true;
}

// Something has happened, and nobody knows what: it is lost, as if it had been overtaken.
void TapCore::disbelieve(Stream& stream) noexcept {
  shm::EventRecord& head = stream.head;
  const bool has_happened =
      head.kind != shm::EventKind::kState && head.kind != shm::EventKind::kDestinations;
  if (has_happened) ++stream.head_lost;
  be_state(head);
  if (!has_credible_time(stream)) head.time = stream.last.time;
}

// What the source is like where it goes on.
void TapCore::be_state(shm::EventRecord& head) noexcept {
  head.kind = shm::EventKind::kState;
  head.masks = {};
}

// Nothing is read from it any more, and of that, at least, its users shall know.
void TapCore::give_up(Stream& stream, std::uint64_t lost) noexcept {
  stream.source->misbehaved.store(true, std::memory_order_relaxed);
  service_bell_->ring();
  end(stream);
  stream.head_lost = lost;
}

// True: the stream has a next event.
bool TapCore::look_at(Stream& stream) noexcept {
  using Found = shm::EventReader::Found;
  if (stream.has_head) return true;
  if (stream.ended) return false;
  const bool gone = stream.gone;  // before the look: what it has told comes before its end
  // What it told before is no more than its ring holds: whoever goes on writing is not heard.
  const auto may_have_more = [&] { return stream.behind_end <= stream.source->shape.events; };
  for (int passed = 0; may_have_more() && stream.reader.join(); ++passed) {
    if (passed == kMaxPassedOver) {  // whoever waits comes again at once, for nobody else may ring
      shm::ring_bell(bell_.write_end().get());
      return false;
    }
    std::uint64_t lost = 0;
    const Found found = stream.reader.read(stream.head, lost);
    if (found == Found::kNothing) break;
    if (gone) ++stream.behind_end;
    stream.head_lost = lost;
    if (!is_honest(stream)) {
      give_up(stream, found == Found::kGap ? lost : lost + 1);
      return stream.has_head = true;
    }
    const bool is_anothers = found == Found::kEvent && stream.head.kind == shm::EventKind::kState &&
                             stream.head.joined != stream.source->link;
    if (is_anothers) continue;
    if (found == Found::kGap) be_state(stream.head);
    if (!has_credible_time(stream) || !has_credible_activity(stream.head)) disbelieve(stream);
    return stream.has_head = true;
  }
  if (!gone) return false;
  end(stream);
  return stream.has_head = true;
}

// Where the source's page does not say what the last event says, the publisher was killed after it
// had stamped an arrival or a deactivation, and before it told of it.
void TapCore::end(Stream& stream) noexcept {
  stream.head = stream.last;
  stream.head.masks = {};
  stream.head_lost = stream.has_begun && stream.end && *stream.end != stream.last.activity ? 1 : 0;
  if (stream.end) stream.head.activity = *stream.end;
  stream.head_is_end = true;
}

void TapCore::look_at_inputs() {
  const shm::Nanoseconds now = shm::monotonic_now();
  if (now - looked_ < kLookInterval || takes_.size() >= kMaxTakes) return;
  looked_ = now;
  for (const TapInputLink& link : view_->inputs) {
    if (link.input->drained.load(std::memory_order_relaxed)) continue;
    news_.clear();
    link.input->watch->look(link.gone, news_);
    for (const TakeWatch::News& news : news_) takes_.push_back({now, news});
    if (!link.gone) continue;
    link.input->drained.store(true, std::memory_order_relaxed);
    service_bell_->ring();
  }
}

void TapCore::fill(const Take& take, TapEventData& event) {
  // Never destroyed: static objects may be taps.
  static const auto& nobody =
      *new std::shared_ptr<const TapContext>(std::make_shared<const TapContext>());
  event = {};
  event.kind = take.news.is_overtaken ? kOvertaken : kDropped;
  event.time_ns = take.seen;
  event.count = take.news.count;
  event.sequence = take.news.sequence;
  const auto source = known_.find(take.news.source);
  event.context = source == known_.end() ? nobody : source->second;
}

// By when it comes among the events of several sources: by its time. But a publisher that writes
// old times as fast as they are taken would come first for ever, and the others would be overtaken.
// A ring's length behind an event comes none that was there when that was read; so each counts as
// no older than the beginning of the round before its own.
shm::Nanoseconds TapCore::order_of_head(const Stream& stream) noexcept {
  return std::max(stream.head.time, stream.since);
}

void TapCore::count_round(Stream& stream) noexcept {
  if (stream.taken == 0) stream.since = std::exchange(stream.round, shm::monotonic_now());
  if (++stream.taken == stream.source->shape.events) stream.taken = 0;
}

// What a publisher tells first has no time of its own: it waits until all has been told of those
// who had the port before.
bool TapCore::has_predecessor(const Stream& stream) const noexcept {
  return std::any_of(streams_.data(), &stream, [&](const Stream& before) {
    return before.gone && !before.ended && before.source->name == stream.source->name;
  });
}

TapCore::Stream* TapCore::oldest() noexcept {
  Stream* oldest = nullptr;
  bool is_behind_end = false;  // one of those before goes
  for (Stream& stream : streams_) {
    const bool has_news = look_at(stream) && !(is_behind_end && has_predecessor(stream));
    is_behind_end = is_behind_end || (stream.gone && !stream.ended);
    if (!has_news) continue;
    if (oldest == nullptr || order_of_head(stream) < order_of_head(*oldest)) oldest = &stream;
  }
  return oldest;
}

bool TapCore::take_once(TapEventData& event) {
  if (handover_.has_offer()) accept_view();
  if (view_ != nullptr && !view_->inputs.empty()) look_at_inputs();
  Stream* const stream = oldest();
  if (!takes_.empty() && (stream == nullptr || order_of_head(*stream) > takes_.front().seen)) {
    fill(takes_.front(), event);
    takes_.pop_front();
    return true;
  }
  if (stream == nullptr) return false;
  if (stream->head.kind == shm::EventKind::kSample && options_.max_held != 0 &&
      held_ == options_.max_held) {
    throw Error(name_ + ": " + std::to_string(options_.max_held) +
                " events with samples are held already; let one go first, or raise max_held");
  }
  fill(*stream, event);
  return true;
}

void TapCore::fill(Stream& stream, TapEventData& event) {
  give_context(stream);
  const shm::EventRecord& head = stream.head;
  event.kind = stream.head_is_end ? kEnd : static_cast<std::uint8_t>(head.kind);
  event.time_ns = head.time;
  event.sequence = shm::sequence_of(head.sample);
  event.generation = head.generation;
  event.activity = head.activity;
  event.lost = stream.head_lost;
  event.accepted = head.masks.accepted;
  event.discarded = head.masks.discarded;
  event.refused = head.masks.refused;
  event.blind = head.masks.blind;
  const bool is_arrival =
      head.kind == shm::EventKind::kSample || head.kind == shm::EventKind::kSignal;
  event.origin = {};
  if (is_arrival && !stream.head_is_end) {
    const shm::SampleOrigin& origin = stream.reader.origin();
    event.origin = {origin.publisher, origin.sequence};
  }
  event.count = 0;
  event.size = std::min<std::uint64_t>(head.size, stream.source->output->segment.layout().stride);
  event.data = nullptr;
  event.context = stream.context;
  if (!stream.head_is_end && head.kind == shm::EventKind::kSample && options_.max_held != 0 &&
      !hold(stream, event)) {
    ++lost_samples_;
  }
  lost_events_ += stream.head_lost;
  stream.has_begun = true;
  stream.last = head;
  stream.has_head = false;
  count_round(stream);
  if (stream.head_is_end) {
    stream.ended = true;
    // One that was given up stays while its port is there: the next daemon tells of it again, and
    // it would be taken for another.
    if (stream.gone) let_go(stream);
  }
}

void TapCore::let_go(const Stream& stream) noexcept {
  if (stream.source->drained.load(std::memory_order_relaxed)) return;
  stream.source->drained.store(true, std::memory_order_relaxed);
  service_bell_->ring();
}

// A list that is gone leaves the names unknown, and so does one that no honest publisher writes.
void TapCore::give_context(Stream& stream) {
  if (stream.context != nullptr && stream.revision == stream.head.revision) return;
  auto context = std::make_shared<TapContext>();
  context->source = stream.source->name;
  context->type = stream.source->output->type;
  shm::Destinations destinations;
  if (shm::read_destinations(*stream.source->events, stream.source->shape, stream.head.revision,
                             destinations) &&
      can_be_ports(destinations)) {
    for (shm::Destination& destination : destinations) {
      context->destinations.push_back(std::move(destination.name));
    }
  }
  stream.context = std::move(context);
  stream.revision = stream.head.revision;
}

bool TapCore::hold(Stream& stream, TapEventData& event) noexcept {
  std::uint32_t index = 0;
  while (index < options_.max_held && held_from_[index] != nullptr) ++index;
  if (index == options_.max_held) return false;  // held_ < max_held says that this is never so
  shm::Atomic<shm::Hold>& word = segment_->holds[index];
  if (!stream.reader.hold(stream.head.sample, word)) return false;
  const OutputPeer& output = *stream.source->output;
  const std::uint32_t slot = shm::slot_of(stream.head.sample);
  event.hold = index;
  if (slot < output.allocated_slots.load(std::memory_order_relaxed)) {
    event.data = output.segment.payload(slot);
  } else if (!copy(stream, slot, event)) {
    shm::ChannelReader::release(word);
    return false;
  }
  if (type_.one_size() != 0) event.size = type_.one_size();
  held_from_[index] = stream.source;
  ++output.held;
  ++held_;
  return true;
}

// As InputCore::copy().
bool TapCore::copy(const Stream& stream, std::uint32_t slot, TapEventData& event) noexcept {
  const OutputPeer& output = *stream.source->output;
  output.copied.store(output.copied.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  service_bell_->ring();
  for (std::uint32_t i = 0; i < options_.max_held; ++i) {
    if (held_from_[i] == nullptr) copies_.forget(i);
  }
  CopiedSample copied;
  if (!copies_.copy(output, slot, type_.one_size() != 0, event.hold, copied)) return false;
  event.data = copied.data;
  return true;
}

void TapCore::give_back(std::uint32_t hold) noexcept {
  shm::ChannelReader::release(segment_->holds[hold]);
  --held_from_[hold]->output->held;
  held_from_[hold].reset();
  --held_;
}

bool TapCore::take(TapEventData& event) {
  if (take_once(event)) return true;
  if (!has_descriptor_) return false;
  disarm();
  arm();
  return take_once(event);
}

}  // namespace arbiter::detail
