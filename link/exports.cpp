#include "link/exports.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <iterator>
#include <system_error>
#include <utility>

#include "gateway/core/say.hpp"
#include "link/say_sparingly.hpp"
#include "shm/clock.hpp"

namespace arbiter::link {
namespace {

using gateway::Level;
using gateway::say;

constexpr std::uint64_t kWakeId = 0;
constexpr shm::Nanoseconds kTapAgain = 5'000'000'000;
// Events of one source that leave before others have their turn.
constexpr int kMostAtOnce = 64;
constexpr int kSayAgain = 10;  // ms

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

Exports::Exports(Node& node, const Network& network, const HeldTokens& tokens, std::string host,
                 Incarnation incarnation, const gateway::Bell& bell)
    : node_(node),
      network_(network),
      tokens_(tokens),
      host_(std::move(host)),
      incarnation_(incarnation),
      bell_(bell),
      epoll_(epoll_create1(EPOLL_CLOEXEC)),
      wake_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.u64 = kWakeId;
  if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, wake_.get(), &event) != 0) {
    throw std::system_error(errno, std::generic_category(), "no descriptors to watch taps by");
  }
  thread_ = std::thread([this] { run(); });
}

Exports::~Exports() {
  {
    const auto lock = lock_first();
    ends_ = true;
  }
  wake();
  thread_.join();
}

void Exports::wake() const noexcept {
  const std::uint64_t one = 1;
  static_cast<void>(!::write(wake_.get(), &one, sizeof one));
}

void Exports::look(const HostView& view, const Patience& patience) {
  withdraw(view.open_here());
  for (const auto& [source, type] : view.open_here()) offer(source, type);
  tap_what_is_wanted(view, patience);
}

void Exports::withdraw(const HostView::OpenPorts& ports) {
  for (auto each = ids_.begin(); each != ids_.end();) {
    if (ports.contains(each->first)) {
      ++each;
      continue;
    }
    std::unique_ptr<Export> gone;  // its tap is closed without the lock
    {
      const auto lock = lock_first();
      gone = std::move(exports_.at(each->second));
      exports_.erase(each->second);
    }
    each = ids_.erase(each);
  }
}

void Exports::offer(const std::string& source, const std::optional<shm::TypeInfo>& type) {
  const auto id = ids_.find(source);
  if (id != ids_.end()) {
    const auto lock = lock_first();
    if (type) know_type(*exports_.at(id->second), *type);
    return;
  }
  OfferCard card;
  card.incarnation = incarnation_of(last_id_ + 1);
  card.host = host_;
  card.source = source;
  if (type) {
    card.type_revision = 1;
    card.type = *type;
  }
  auto one = std::make_unique<Export>(network_, std::move(card), bell_);
  const auto lock = lock_first();
  exports_.emplace(++last_id_, std::move(one));
  ids_.emplace(source, last_id_);
}

Incarnation Exports::incarnation_of(std::uint64_t id) const noexcept {
  const Incarnation incarnation = incarnation_ + id;
  return incarnation != 0 ? incarnation : incarnation_;  // which no other id leads to
}

void Exports::tap_what_is_wanted(const HostView& view, const Patience& patience) {
  for (const auto& [source, id] : ids_) {
    Export& one = *exports_.at(id);
    const bool is_wanted = one.writer.is_wanted();
    if (is_wanted == one.tap.has_value()) continue;
    if (is_wanted && shm::monotonic_now() >= one.tap_again && patience.is_left()) {
      open_tap(one, id, view);
      patience.note_call();
    } else if (!is_wanted) {
      std::optional<Tap<void>> gone;
      const auto lock = lock_first();
      gone.swap(one.tap);
    }
  }
}

// The other thread uses a tap once it is in the export, and not before.
void Exports::open_tap(Export& one, std::uint64_t id, const HostView& view) {
  try {
    Tap<void> tap = node_.tap(one.card.source);
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = id;
    const int descriptor = tap.fd();
    const auto lock = lock_first();
    one.tap = std::move(tap);
    if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, descriptor, &event) != 0) {
      one.tap.reset();
      throw Error("no descriptor can be watched");
    }
    one.said.clear();
    // Its publisher tells the tap of the source at its next arrival, which may be a long time away.
    state(one, view.is_deactivated(one.card.source));
    ready_.insert(id);  // a tap rings once somebody has found nothing in it
    wake();
  } catch (const Error& error) {
    one.tap_again = shm::monotonic_now() + kTapAgain;
    if (one.said == error.what()) return;
    const std::string text =
        one.card.source + " cannot be sent to the hosts that want it: " + error.what();
    if (say_sparingly(Level::kWarning, text)) one.said = error.what();
  }
}

std::unique_lock<std::mutex> Exports::lock_first() {
  const std::lock_guard gate(gate_);
  return std::unique_lock(mutex_);
}

std::unique_lock<std::mutex> Exports::lock_after() {
  { const std::lock_guard gate(gate_); }
  return std::unique_lock(mutex_);
}

void Exports::run() {
  std::array<epoll_event, 64> events{};
  for (int patience = -1;;) {
    const int count =
        epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), patience);
    if (!take_up(events.data(), count)) return;
    const auto lock = lock_after();
    for (auto each = ready_.begin(); each != ready_.end();) {
      const auto found = exports_.find(*each);
      const bool more = found != exports_.end() && found->second->tap && send_some(*found->second);
      each = more ? std::next(each) : ready_.erase(each);
    }
    const bool is_left = say_unsaid();
    patience = !ready_.empty() ? 0 : (is_left ? kSayAgain : -1);
  }
}

bool Exports::take_up(const epoll_event* events, int count) {
  const auto lock = lock_after();
  for (int i = 0; i < count; ++i) {
    const std::uint64_t id = events[i].data.u64;
    if (id != kWakeId) {
      ready_.insert(id);
      continue;
    }
    std::uint64_t rings = 0;
    static_cast<void>(!::read(wake_.get(), &rings, sizeof rings));
  }
  return !ends_;
}

// Under the lock. True: there may be more. Only a tap that has nothing left rings again.
bool Exports::send_some(Export& one) {
  for (int i = 0; i < kMostAtOnce; ++i) {
    const auto event = one.tap->take();
    if (!event) return false;
    // Whom else the source reaches here is nobody's business there.
    if (event->kind() != TapEventKind::destinations || event->lost() != 0) send(one, *event);
  }
  return true;
}

void Exports::send(Export& one, const TapEvent<void>& event) {
  know_type(one, info_of(event.type()));
  one.number += event.lost();  // that the tap has missed
  one.sequence = event.sequence();
  const auto sample =
      event.kind() == TapEventKind::sample ? event.sample() : std::optional<Bytes>();
  header_.kind = kind_of(event.kind());
  // A sample that was overwritten before it could be sent, or that is too large, is an arrival
  // nevertheless.
  const bool has_sample = sample && sample->size() <= kMaxSampleBytes;
  if (header_.kind == EventKind::kSample && !has_sample) header_.kind = EventKind::kSignal;
  header_.is_deactivated = header_.kind == EventKind::kDeactivation ||
                           (header_.kind == EventKind::kState && event.is_deactivated());
  // Its publisher has written the time: it may be any.
  const shm::Nanoseconds published = event.time().time_since_epoch().count();
  tokens_.name(std::min(published, shm::monotonic_now()), header_.tokens);
  write(one, has_sample ? *sample : Bytes());
}

void Exports::state(Export& one, bool is_deactivated) {
  header_.kind = EventKind::kState;
  header_.is_deactivated = is_deactivated;
  header_.tokens.clear();
  write(one, {});
}

bool Exports::say_unsaid() {
  bool is_left = false;
  for (const auto& [id, one] : exports_) {
    if (one->is_unsaid) state(*one, one->is_deactivated);
    is_left = is_left || one->is_unsaid;
  }
  return is_left;
}

// Sends header_, which says what has happened, and the sample.
void Exports::write(Export& one, Bytes sample) {
  header_.exporter = one.card.incarnation;
  header_.number = ++one.number;
  header_.sequence = one.sequence;
  header_.type_revision = one.card.type_revision;
  header_.length = static_cast<std::uint32_t>(sample.size());
  const WritableBytes bytes(buffer_.data(), header_bytes(header_));
  write_header(header_, bytes);
  one.is_deactivated = header_.is_deactivated;
  // An event that is not sent has used a number, so importers count it as lost.
  one.is_unsaid = !one.writer.write(bytes, sample);
}

void Exports::know_type(Export& one, const shm::TypeInfo& type) {
  OfferCard& card = one.card;
  if (card.type_revision != 0 && card.type == type && card.type.size == type.size) return;
  ++card.type_revision;
  card.type = type;
  try {
    one.writer.set_card(card);
  } catch (const DdsError& error) {
    say(Level::kError, error.what());
  }
}

}  // namespace arbiter::link
