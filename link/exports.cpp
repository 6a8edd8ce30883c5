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
#include "link/first_failure.hpp"
#include "link/say_sparingly.hpp"
#include "shm/clock.hpp"

namespace arbiter::link {
namespace {

using gateway::Level;
using gateway::say;

constexpr std::uint64_t kWakeId = 0;
constexpr std::uint64_t kReadersId = ~std::uint64_t{0};
constexpr shm::Nanoseconds kTapAgain = 5'000'000'000;
// Events of one source that leave before others have their turn.
constexpr int kMostAtOnce = 64;
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

Exports::Exports(Node& node, const Network& network, const HeldTokens& tokens, std::string host,
                 Incarnation incarnation, const gateway::Bell& bell)
    : node_(node),
      network_(network),
      tokens_(tokens),
      host_(std::move(host)),
      incarnation_(incarnation),
      bell_(bell),
      epoll_(epoll_create1(EPOLL_CLOEXEC)),
      wake_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
      demands_(network, EndWatch::Ends::kReaders, readers_) {
  for (const auto& [id, descriptor] :
       {std::pair(kWakeId, wake_.get()), std::pair(kReadersId, readers_.descriptor())}) {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = id;
    if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, descriptor, &event) != 0) {
      throw std::system_error(errno, std::generic_category(), "no descriptors to watch taps by");
    }
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
  FirstFailure failure;
  for (const auto& each : view.open_here()) {
    failure.attempt([&] { offer(each.first, each.second); });
  }
  tap_what_is_wanted(view, patience);
  failure.rethrow();
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

void Exports::offer(const std::string& source, const shm::TypeInfo& type) {
  const auto id = ids_.find(source);
  if (id != ids_.end()) {
    const auto lock = lock_first();
    Export& one = *exports_.at(id->second);
    // A tap knows it better: how things stand was asked some time ago.
    if (!one.tap) know_type(one, type);
    return;
  }
  OfferCard card;
  card.incarnation = incarnation_of(last_id_ + 1);
  card.host = host_;
  card.source = source;
  card.type_revision = 1;
  card.type = type;
  auto one = std::make_unique<Export>(network_, std::move(card), readers_);
  const auto lock = lock_first();
  exports_.emplace(++last_id_, std::move(one));
  ids_.emplace(source, last_id_);
  readers_.ring();  // those that came before it was here
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
      one.kept.end();
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
  return !ends_;
}

// Under the lock. True: there may be more. Only a tap that has nothing left rings again. The first
// event leaves at once, and so does a large sample; small ones that have waited leave together.
bool Exports::send_some(Export& one) {
  std::optional<DatagramTrain::Boarding> boarding;
  for (int i = 0; i < kMostAtOnce; ++i) {
    const auto event = one.tap->take();
    if (!event) return false;
    // Whom else the source reaches here is nobody's business there.
    if (event->kind() == TapEventKind::destinations && event->lost() == 0) continue;
    const bool is_large = event->size() > kAlone;
    if (!boarding && (is_large || i != 0)) boarding.emplace(train_);
    send(one, *event);
    if (is_large) train_.depart();
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
}

// Whatever says that there is something may say so of what is gone, or twice: each looks at what is
// so now. A reader may match before or after what it wants is known here.
bool Exports::hear_readers() {
  bool has_changed = false;
  for (const auto& [id, one] : exports_) {
    if (one->writer.changes_of_readers() == one->reader_changes) continue;
    hear_readers(*one);
    has_changed = true;
  }
  const std::vector<std::string> topics = demands_.changed();
  if (topics.empty()) return has_changed;
  for (const auto& [id, one] : exports_) {
    if (std::binary_search(topics.begin(), topics.end(), one->writer.topic())) hear_readers(*one);
  }
  return has_changed;
}

void Exports::hear_readers(Export& one) {
  one.reader_changes = one.writer.changes_of_readers();
  one.demand = one.writer.demand();
  const bool is_due = one.kept.is_there() && !is_withheld(one.demand, one.kept.sample().size());
  if (is_due) send_again(one);
  if (is_due || one.demand == Demand::kSamples) one.kept.end();
}

// It is no other event, and bears the number of the last one.
void Exports::send_again(Export& one) {
  header_.kind = EventKind::kAgain;
  header_.is_deactivated = false;
  header_.tokens = one.kept.tokens();
  const DatagramTrain::Boarding boarding(train_);
  // One that is not sent is missed until the next one.
  static_cast<void>(put(one, one.kept.sample()));
}

void Exports::state(Export& one, bool is_deactivated) {
  header_.kind = EventKind::kState;
  header_.is_deactivated = is_deactivated;
  header_.tokens.clear();
  write(one, {});
}

bool Exports::say_unsaid() {
  if (!has_unsaid_) return false;
  bool is_left = false;
  for (const auto& [id, one] : exports_) {
    if (one->is_unsaid) state(*one, one->is_deactivated);
    is_left = is_left || one->is_unsaid;
  }
  has_unsaid_ = is_left;
  return is_left;
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
  return one.writer.write(bytes, sample);
}

void Exports::know_type(Export& one, const shm::TypeInfo& type) {
  OfferCard& card = one.card;
  if (card.type == type && card.type.size == type.size) return;
  ++card.type_revision;
  card.type = type;
  one.kept.drop();  // it is of the type before
  try {
    one.writer.set_card(card);
  } catch (const DdsError& error) {
    say(Level::kError, error.what());
  }
}

}  // namespace arbiter::link
