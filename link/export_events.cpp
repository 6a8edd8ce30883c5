// What a link sends of its exports, on a thread of its own.
#include <sched.h>
#include <sys/epoll.h>
#include <unistd.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "gateway/core/say.hpp"
#include "link/core/said_type.hpp"
#include "link/exports.hpp"
#include "shm/clock.hpp"

namespace arbiter::link {
namespace {

using gateway::Level;
using gateway::say;

// Of one source, before others have their turn: events, and bytes of their samples.
constexpr int kMostAtOnce = 64;
constexpr std::size_t kMostBytesAtOnce = 1 << 20;
constexpr int kSayAgain = 10;         // ms
constexpr std::size_t kAlone = 1024;  // bytes of a sample that is one datagram

shm::TypeInfo info_of(const Type& type) {
  shm::TypeInfo info;
  info.set_name(type.name());
  info.size = type.size();
  info.alignment = type.alignment();
  return info;
}

EventKind kind_of(TapEventKind kind) {
  switch (kind) {
    case TapEventKind::sample:
      return EventKind::kSample;
    case TapEventKind::signal:
      return EventKind::kSignal;
    case TapEventKind::deactivation:
      return EventKind::kDeactivation;
    default:
      return EventKind::kState;
  }
}

}  // namespace

int Exports::await_events(std::array<epoll_event, kMostEvents>& events,
                          int milliseconds) const noexcept {
  while (milliseconds != 0 && rush_.lasts(shm::monotonic_now())) {
    const int count = epoll_wait(epoll_.get(), events.data(), kMostEvents, 0);
    if (count != 0) return count;
    sched_yield();
  }
  return epoll_wait(epoll_.get(), events.data(), kMostEvents, milliseconds);
}

void Exports::run() {
  std::array<epoll_event, kMostEvents> events{};
  for (int patience = -1;;) {
    const int count = await_events(events, patience);
    const shm::Nanoseconds woken = shm::monotonic_now();
    if (!take_up(events.data(), count)) return;
    for (const std::uint64_t id : turns_) take_turn(id);
    if (std::exchange(has_taken_, false)) rush_.come(woken);
    rush_.rest(shm::monotonic_now());
    const auto lock = lock_after();
    const bool is_left = say_unsaid();
    patience = !ready_.empty() ? 0 : (is_left ? kSayAgain : -1);
  }
}

void Exports::take_turn(std::uint64_t id) {
  Export* const one = begin_turn(id);
  if (one != nullptr) end_turn(send_some(*one));
}

Exports::Export* Exports::begin_turn(std::uint64_t id) {
  const auto lock = lock_after();
  const auto found = exports_.find(id);
  if (ends_ || found == exports_.end() || !found->second->tap) {
    ready_.erase(id);
    return nullptr;
  }
  in_turn_ = id;
  return found->second.get();
}

void Exports::end_turn(bool is_left) {
  const auto lock = lock_after();
  if (!is_left) ready_.erase(in_turn_);
  in_turn_ = 0;
}

bool Exports::take_up(const epoll_event* events, int count) {
  const auto lock = lock_after();
  for (int i = 0; i < count; ++i) {
    const std::uint64_t id = events[i].data.u64;
    if (id == kReadersId) {
      readers_.silence();
      if (hear_readers()) bell_.ring();  // look() opens and closes taps by it
      continue;
    }
    if (id != kWakeId) {
      ready_.insert(id);
      continue;
    }
    std::uint64_t rings = 0;
    static_cast<void>(!::read(wake_.get(), &rings, sizeof rings));
  }
  turns_.assign(ready_.begin(), ready_.end());
  return !ends_;
}

// True: there may be more. Only a tap that has nothing left rings again. The first event leaves at
// once, and so does a large sample; small ones that have waited leave together.
bool Exports::send_some(Export& one) {
  if (one.is_unsaid) state(one, one.is_deactivated);
  send_kept(one);
  std::optional<DatagramTrains::Boarding> boarding;
  std::size_t bytes = 0;
  for (int i = 0; i < kMostAtOnce && bytes < kMostBytesAtOnce; ++i) {
    const auto event = one.tap->take();
    if (!event) return false;
    has_taken_ = true;
    // Whom else the source reaches here is nobody's business there.
    if (event->kind() == TapEventKind::destinations && event->lost() == 0) continue;
    const bool is_large = event->size() > kAlone;
    if (!boarding && (is_large || i != 0)) boarding.emplace(trains_);
    bytes += send(one, *event);
    if (is_large) trains_.depart();
  }
  return true;
}

std::size_t Exports::send(Export& one, const TapEvent<void>& event) {
  const bool is_known = know_type(one, info_of(event.type()));
  one.number += event.lost();  // that the tap has missed
  one.sequence = event.sequence();
  const auto sample =
      event.kind() == TapEventKind::sample ? event.sample() : std::optional<Bytes>();
  header_.kind = kind_of(event.kind());
  // A sample that was overwritten before it could be sent, that is too large, or of a type that is
  // not known there, is an arrival nevertheless.
  const bool has_sample = sample && is_known && sample->size() <= kMaxSampleBytes;
  if (header_.kind == EventKind::kSample && !has_sample) header_.kind = EventKind::kUnsent;
  header_.is_deactivated = header_.kind == EventKind::kDeactivation ||
                           (header_.kind == EventKind::kState && event.is_deactivated());
  const bool stays = has_sample && is_withheld(one.demand, sample->size());
  if (stays) header_.kind = EventKind::kWithheld;
  // Its publisher has written the time: it may be any.
  const shm::Nanoseconds published = event.time().time_since_epoch().count();
  tokens_.name(std::min(published, shm::monotonic_now()), header_.tokens);
  write(one, has_sample && !stays ? *sample : Bytes());
  // What was missed may have made it old.
  const bool is_over = event.kind() == TapEventKind::sample || header_.is_deactivated ||
                       event.lost() != 0 || event.kind() == TapEventKind::closed;
  if (is_over) one.kept.drop();
  if (stays) one.kept.keep(header_.tokens, *sample);
  return has_sample && !stays ? sample->size() : 0;
}

// Whatever says that there is something may say so of what is gone, or twice: each looks at what is
// so now. A reader may match before or after what it wants is known here.
bool Exports::hear_readers() {
  bool has_changed = false;
  for (const auto& [id, one] : exports_) {
    if (one->writer.changes_of_readers() == one->reader_changes) continue;
    hear_readers(id, *one);
    has_changed = true;
  }
  const std::vector<std::string> topics = demands_.changed();
  if (topics.empty()) return has_changed;
  for (const auto& [id, one] : exports_) {
    if (std::binary_search(topics.begin(), topics.end(), one->writer.topic()))
      hear_readers(id, *one);
  }
  return has_changed;
}

void Exports::hear_readers(std::uint64_t id, Export& one) {
  one.reader_changes = one.writer.changes_of_readers();
  one.is_wanted = one.writer.is_wanted();
  one.demand = one.writer.demand();
  // Its state is said in its place: who comes later would have the sample without wanting it.
  if (one.written != 0 && is_withheld(one.demand, one.written)) {
    one.is_unsaid = true;
    ready_.insert(id);
  }
  if (one.kept.is_there()) {
    ready_.insert(id);
  } else if (one.demand == Demand::kSamples) {
    one.kept.end();
  }
}

// Sends what was withheld, once it is wanted after all. It is no other event, and bears the number
// of the last one.
void Exports::send_kept(Export& one) {
  if (!one.kept.is_there() || is_withheld(one.demand, one.kept.sample().size())) return;
  header_.kind = EventKind::kAgain;
  header_.is_deactivated = false;
  header_.tokens = one.kept.tokens();
  const DatagramTrains::Boarding boarding(trains_);
  // One that is not sent is missed until the next one.
  static_cast<void>(put(one, one.kept.sample()));
  one.kept.end();
}

void Exports::state(Export& one, bool is_deactivated) {
  header_.kind = EventKind::kState;
  header_.is_deactivated = is_deactivated;
  header_.tokens.clear();
  write(one, {});
}

bool Exports::say_unsaid() {
  if (!std::exchange(has_closed_, false) && !has_unsaid_) return false;
  bool is_left = false;
  for (const auto& [id, one] : exports_) {
    if (one->is_unsaid) state(*one, one->is_deactivated);
    if (!one->tap && one->written != 0) drop_sample(*one);
    is_left = is_left || one->is_unsaid || (!one->tap && one->written != 0);
  }
  has_unsaid_ = is_left;
  return is_left;
}

// It is no other event: where nobody reads it, nobody has missed one.
void Exports::drop_sample(Export& one) {
  header_.kind = EventKind::kState;
  header_.is_deactivated = one.is_deactivated;
  header_.tokens.clear();
  static_cast<void>(put(one, {}));
}

// Sends header_, which says what has happened, and the sample.
void Exports::write(Export& one, Bytes sample) {
  ++one.number;
  one.is_deactivated = header_.is_deactivated;
  // An event that is not sent has used a number, so importers count it as lost.
  one.is_unsaid = !put(one, sample);
  has_unsaid_ = has_unsaid_ || one.is_unsaid;
}

bool Exports::put(Export& one, Bytes sample) {
  header_.exporter = one.card.incarnation;
  header_.number = one.number;
  header_.sequence = one.sequence;
  header_.type_revision = one.card.type_revision;
  header_.length = static_cast<std::uint32_t>(sample.size());
  const WritableBytes bytes(buffer_.data(), header_bytes(header_));
  write_header(header_, bytes);
  const bool is_written = one.writer.write(bytes, sample);
  if (is_written) one.written = sample.size();
  return is_written;
}

bool Exports::know_type(Export& one, const shm::TypeInfo& type) {
  try {
    const bool is_new =
        say_type(one.card, type, [&](const OfferCard& card) { one.writer.set_card(card); });
    if (is_new) one.kept.drop();  // it is of the type before
    one.has_said_unknown = false;
    return true;
  } catch (const DdsError& error) {  // the next sample tries again
    one.kept.drop();
    if (!std::exchange(one.has_said_unknown, true)) say(Level::kError, error.what());
    return false;
  }
}

}  // namespace arbiter::link
