// Taps: watching a source, or an input port, without being a destination.
//
//   arbiter::Tap<> tap = node.tap("/Object/pos:o");
//   while (auto event = tap.wait_for(1s)) {
//     if (event->kind() == arbiter::TapEventKind::sample) show(event->source(), event->sample());
//     for (const auto& met : event->destinations()) show(met.port, met.fate);
//   }
//
// A tap changes no decision, wakes no component, and holds up no publisher, even if the program
// that watches is stopped or killed. It is no port: no model mentions it, no rule sees it, and it
// takes none of a source's 64 destinations. It may be opened before there is such a port, and goes
// on over closing and opening, over the death of the port's component, and over another daemon.
// The daemon's policy must allow this user to `tap` the port (docs/policy.md).
//
// The first event of a source is its `state`: from there on nothing is missed. The port's thread
// tells it at its next call, so a source at rest has none yet. A component takes a tap in before
// Node::tap() returns, unless it needs more than 0.2 s for that: it is stopped, or makes memory for
// large samples.
//
// A publisher keeps its last 1024 events and its last 64 samples for its taps (fewer samples where
// they are large: 32 MiB of them). A tap that is slower loses its own oldest events, which are
// counted; the next event is then a `state`, with the activity that the source has from there on.
//
// A publisher writes its events into memory of its own, where it may write anything. What no honest
// one writes does not come: an event whose time is before that of the event before it, or has not
// come yet, an arrival that leaves the source inactive, or a deactivation that does not, counts as
// lost, and a `state` stands in its place; a list of destinations with a name that no port can have
// is not known. After what cannot be read as an event at all, the source is `closed`, one event is
// lost, and a notice (NoticeKind::refused) says so.
//
// Units: sizes in bytes, times in nanoseconds of CLOCK_MONOTONIC. Threads: use a tap, and its
// events, from one thread at a time. Blocking: only wait_for() blocks. Cost: take() needs no lock
// and no system call, and allocates only where a source's destinations have changed, or an input
// port has not given out what it had accepted. A publish of a source that is tapped takes some 220
// to 250 instructions more, however many taps there are; if one of them sleeps, a ring more.
// Errors: take() and wait_for() throw arbiter::Error for more than max_held events with samples.
// The paper has nothing of it.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <arbiter/bytes.hpp>
#include <arbiter/detail/cores.hpp>
#include <arbiter/latencies.hpp>
#include <arbiter/options.hpp>
#include <arbiter/result.hpp>
#include <arbiter/type.hpp>

namespace arbiter {

enum class TapEventKind : std::uint8_t {
  state = 1,     // nothing has happened: what the source is like. When it begins to be watched, and
                 // behind a gap (lost())
  sample,        // an arrival with a sample
  signal,        // an arrival without one
  deactivation,  // the source's activity was ended
  destinations,  // the source's list of destinations has changed
  closed,        // its output port was closed, its component died, or the model does not connect it
                 // any more to the input port that is tapped: this was all
  dropped,       // at the input port that is tapped: samples that were accepted had lost when they
                 // were to be taken
  overtaken,     // there, too: samples gave way to newer ones in a full queue
};

// The outcome of an arrival at one input port.
enum class Fate : std::uint8_t {
  none,       // not an arrival, or not connected there
  accepted,   // the connection was the winner: the sample was queued; a signal has no sample
  discarded,  // another connection was the winner, or none
  refused,    // the winner, but its queue was full (refuse_new) or its connection is refused
  blind,      // no decision: not all sources that the rules read could be seen, or the component at
              // a port that keeps all, or is not arbitrated, has not taken up the connection yet
};

struct TapDestination {
  std::string_view port;  // the input port's name; valid while the event is
  Fate fate = Fate::none;
};

// An event. One with a sample holds it, as a Sample of an input port does: until the event leaves
// its scope the sample's memory is not used again.
class TapEventBase {
 public:
  [[nodiscard]] TapEventKind kind() const noexcept { return static_cast<TapEventKind>(data_.kind); }
  // The name of the output port; valid while the event is. Empty: of samples that were dropped or
  // overtaken, whose they were is not known.
  [[nodiscard]] const std::string& source() const noexcept { return data_.context->source; }
  // The type of the output port, even if the tap is untyped.
  [[nodiscard]] const Type& type() const noexcept { return data_.context->type; }
  // When it happened: the arrival time, or the time of the deactivation, as the publisher has
  // written it. When it was seen: `dropped` and `overtaken`, which happened some milliseconds
  // before. Of other kinds: of the last arrival or deactivation before, or 0. Never below 0, nor
  // later than now, nor before that of an earlier event of the same output port.
  [[nodiscard]] Time time() const noexcept { return Time(std::chrono::nanoseconds(data_.time_ns)); }
  // Of the source's samples, as Sample::sequence(); of other events than samples, that of the last
  // sample before. Of `dropped` and `overtaken`: the input port has done with the source's samples
  // up to this one; 0: not known.
  [[nodiscard]] std::uint64_t sequence() const noexcept { return data_.sequence; }
  // Of the model by which it was decided (`arbiter status`); 0: there was none.
  [[nodiscard]] std::uint64_t generation() const noexcept { return data_.generation; }
  // Bytes of the sample as it was published, be it held or not.
  [[nodiscard]] std::size_t size() const noexcept { return data_.size; }
  // Of an arrival: where it began if its publisher passed it on (OutputPort::publish() with an
  // origin).
  [[nodiscard]] Origin origin() const noexcept { return data_.origin; }
  // How many events of this source were lost immediately before this one, which is of kind `state`
  // then; or `closed`, where a component was killed during an arrival or deactivation that others
  // may have seen, before its taps learnt of it. Those that no honest publisher writes are lost,
  // too.
  [[nodiscard]] std::uint64_t lost() const noexcept { return data_.lost; }
  // How many samples were dropped or overtaken; of other kinds 0.
  [[nodiscard]] std::uint64_t count() const noexcept { return data_.count; }
  // Whether the source was active at that time, by all that had happened up to this event.
  [[nodiscard]] bool was_active_at(Time time) const noexcept {
    return data_.activity > time.time_since_epoch().count();
  }
  // When its activity ends if nothing else happens; empty: never, or it is not active at all.
  [[nodiscard]] std::optional<Time> active_until() const noexcept {
    constexpr std::int64_t kForever = std::int64_t{1} << 62;
    if (data_.activity <= 0 || data_.activity >= kForever) return std::nullopt;
    return Time(std::chrono::nanoseconds(data_.activity));
  }
  // Of a source that was deactivated: when; of one that stays active until it is: when it last
  // arrived. It may have been before this port was opened. Empty: neither.
  [[nodiscard]] std::optional<Time> stands_since() const noexcept {
    constexpr std::int64_t kForever = std::int64_t{1} << 62;
    if (data_.activity >= 0 && data_.activity < kForever) return std::nullopt;
    const std::int64_t flags = data_.activity < 0 ? INT64_MIN : kForever;
    return Time(std::chrono::nanoseconds(data_.activity & ~flags));
  }
  // Whether the source's last event was its deactivation.
  [[nodiscard]] bool is_deactivated() const noexcept { return data_.activity < 0; }

  // What became of an arrival at each of the source's destinations. Empty where their names are not
  // known any more because the list has changed often since, or where one of them cannot be a
  // port's. Allocates.
  [[nodiscard]] std::vector<TapDestination> destinations() const {
    std::vector<TapDestination> all;
    const std::vector<std::string>& names = data_.context->destinations;
    all.reserve(names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
      all.push_back({names[i], fate(std::uint64_t{1} << i)});
    }
    return all;
  }
  // At an input port of that name.
  [[nodiscard]] Fate at(std::string_view port) const noexcept {
    const std::vector<std::string>& names = data_.context->destinations;
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (names[i] == port) return fate(std::uint64_t{1} << i);
    }
    return Fate::none;
  }

 protected:
  TapEventBase(detail::TapCore& core, detail::TapEventData data) noexcept
      : held_(data.data == nullptr ? nullptr : &core, {data.hold}), data_(std::move(data)) {}
  [[nodiscard]] const detail::TapEventData& data() const noexcept { return data_; }

 private:
  [[nodiscard]] Fate fate(std::uint64_t bit) const noexcept {
    if (data_.kind != static_cast<std::uint8_t>(TapEventKind::sample) &&
        data_.kind != static_cast<std::uint8_t>(TapEventKind::signal)) {
      return Fate::none;
    }
    if ((data_.accepted & bit) != 0) return Fate::accepted;
    if ((data_.discarded & bit) != 0) return Fate::discarded;
    if ((data_.refused & bit) != 0) return Fate::refused;
    return (data_.blind & bit) != 0 ? Fate::blind : Fate::none;
  }

  detail::HeldByTap held_;
  detail::TapEventData data_;
};

template <class T = void>
class TapEvent : public TapEventBase {
 public:
  // Read in place. Null: this is no sample, or it had been overwritten when it was taken
  // (Tap::lost_samples()), or max_held is 0.
  [[nodiscard]] const T* sample() const noexcept {
    return data().data == nullptr ? nullptr : std::launder(reinterpret_cast<const T*>(data().data));
  }

 private:
  template <class>
  friend class Tap;
  using TapEventBase::TapEventBase;
};

template <>
class TapEvent<void> : public TapEventBase {
 public:
  // The bytes, read in place. Empty: as a null sample above.
  [[nodiscard]] std::optional<Bytes> sample() const noexcept {
    if (data().data == nullptr) return std::nullopt;
    return Bytes(data().data, data().size);
  }

 private:
  template <class>
  friend class Tap;
  using TapEventBase::TapEventBase;
};

// T = void: untyped; gives the samples of any source as bytes. Movable.
template <class T = void>
class Tap {
 public:
  Tap(Tap&&) noexcept = default;
  Tap& operator=(Tap&& other) noexcept {
    if (this != &other) {
      detail::close_tap(std::move(core_));
      core_ = std::move(other.core_);
    }
    return *this;
  }
  ~Tap() { detail::close_tap(std::move(core_)); }

  // The next event, or empty. Events of one source come in its order; of those that several
  // sources have written by now, the oldest comes first; but a source that goes on writing old
  // times lets the others come after some 2048 events. Wait-free. Throws arbiter::Error if the next
  // event has a sample, and max_held of them are held already.
  [[nodiscard]] std::optional<TapEvent<T>> take() {
    detail::TapEventData data;
    if (!detail::take(*core_, data)) return std::nullopt;
    return TapEvent<T>(*core_, std::move(data));
  }
  // As take(), but blocks, without spinning, until there is an event or the time has passed. Throws
  // arbiter::Error, too, for a tap without TapOptions::may_wait.
  template <class Rep, class Period>
  [[nodiscard]] std::optional<TapEvent<T>> wait_for(std::chrono::duration<Rep, Period> timeout) {
    detail::TapEventData data;
    if (!detail::wait(*core_, detail::saturated(timeout), data)) return std::nullopt;
    return TapEvent<T>(*core_, std::move(data));
  }
  // For poll() and epoll: readable when there may be an event. Then call take() until it returns
  // nothing; that arms the descriptor again. The tap owns it. Throws as wait_for().
  [[nodiscard]] int fd() { return detail::wait_descriptor(*core_); }

  // Events that were lost, of all sources; and samples that were overwritten before their
  // events were taken. Since the tap was opened.
  [[nodiscard]] std::uint64_t lost() const noexcept { return detail::lost_events(*core_); }
  [[nodiscard]] std::uint64_t lost_samples() const noexcept { return detail::lost_samples(*core_); }
  // How long samples waited at the input port that is watched, from publish to take, since this tap
  // watches it. Empty: the tap is of an output port, or no component has the input port open. Takes
  // of a port that nobody taps are not measured. Wait-free, but allocates; reads 1 KiB of memory.
  [[nodiscard]] Latencies latencies() const { return detail::latencies(*core_); }
  // Of the port that is watched.
  [[nodiscard]] const std::string& name() const noexcept { return detail::name(*core_); }

 private:
  friend class Node;
  explicit Tap(std::shared_ptr<detail::TapCore> core) noexcept : core_(std::move(core)) {}

  std::shared_ptr<detail::TapCore> core_;
};

}  // namespace arbiter
