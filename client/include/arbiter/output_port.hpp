// Output ports: where a component's data leaves it (paper, section III).
//
// Units: sizes in bytes, times in nanoseconds of CLOCK_MONOTONIC (arbiter::Time). Threads: use a
// port, and its loans, from one thread at a time. Blocking: no call blocks. None takes a lock or
// allocates, except describe(), and the first call after a connection has come or gone, which
// allocates some 200 bytes for each, or after another model has come into force, if it has more to
// read (docs/real-time.md). A port that has been moved from may be assigned to and destroyed, and
// nothing else: no call checks for that. Errors: each call says what it throws; the others are
// noexcept. Cost: see publish(); measured in docs/benchmarks.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include <arbiter/bytes.hpp>
#include <arbiter/detail/cores.hpp>
#include <arbiter/input_port.hpp>
#include <arbiter/result.hpp>
#include <arbiter/type.hpp>

namespace arbiter {

template <class T = void>
class OutputPort;

// A sample that you write in the memory where receivers will read it. It belongs to the port that
// lent it; if you drop it without publishing, it is free again. May outlive its port.
template <class T>
class Loan {
 public:
  T& operator*() const noexcept { return *get(); }
  T* operator->() const noexcept { return get(); }
  [[nodiscard]] T* get() const noexcept { return std::launder(reinterpret_cast<T*>(data_)); }

 private:
  friend class OutputPort<T>;
  friend class OutputPortBase;
  Loan(detail::OutputCore& core, detail::LoanedSlot slot) noexcept
      : core_(&core, {slot.slot}), data_(slot.data) {}

  detail::LoanedBy core_;  // null once published
  std::byte* data_;
};

// The same for an untyped port: bytes.
template <>
class Loan<void> {
 public:
  const WritableBytes& operator*() const noexcept { return bytes_; }
  const WritableBytes* operator->() const noexcept { return &bytes_; }
  [[nodiscard]] std::byte* data() const noexcept { return bytes_.data(); }
  [[nodiscard]] std::size_t size() const noexcept { return bytes_.size(); }
  // Publish only the first `size` bytes.
  void shrink(std::size_t size) noexcept {
    if (size < bytes_.size()) bytes_ = {bytes_.data(), size};
  }

 private:
  friend class OutputPort<void>;
  friend class OutputPortBase;
  Loan(detail::OutputCore& core, detail::LoanedSlot slot, std::size_t size) noexcept
      : core_(&core, {slot.slot}), bytes_(slot.data, size) {}

  detail::LoanedBy core_;  // null once published
  WritableBytes bytes_;
};

// The common part of typed and untyped output ports. Movable; closing it (by its destructor)
// leaves its source active until its T has passed, and leaves what it has delivered to be taken.
class OutputPortBase {
 public:
  OutputPortBase(OutputPortBase&&) noexcept = default;
  OutputPortBase& operator=(OutputPortBase&& other) noexcept {
    if (this != &other) {
      detail::close_output(std::move(core_));
      core_ = std::move(other.core_);
    }
    return *this;
  }
  ~OutputPortBase() { detail::close_output(std::move(core_)); }

  // Activity without a sample: the source becomes, or stays, active. `discarded` counts the
  // connected input ports at which it is not the winner; nothing is delivered. Wait-free.
  Outcome signal() noexcept { return detail::signal(*core_); }
  // The same, unless it is too late: as publish() with a deadline.
  Outcome signal(Time deadline) noexcept { return detail::signal(*core_, deadline); }
  // The same, and says where it began. See publish() with an origin.
  Outcome signal(Time deadline, Origin origin) noexcept {
    return detail::signal(*core_, deadline, origin);
  }
  // Ends the source's activity at once. Never too late. Once more, it is an event for taps, and
  // changes nothing else. Wait-free.
  void deactivate() noexcept { detail::deactivate(*core_); }

  // Whether anybody could use a sample. False: at the last arrival, a sample or a signal, the
  // source won nowhere, no connected port has `keep`, and no tap reads samples. Until that changes
  // signal() does what publish() would do, so a sample that is expensive to make or to fetch need
  // not be made: signal() instead, ask again, and publish_signalled() where this has become true.
  // Ask right after an arrival; true where nothing is known. Wait-free.
  [[nodiscard]] bool wants_samples() const noexcept { return detail::wants_samples(*core_); }

  // For replay: as signal() and deactivate(), at a given time. See publish_at().
  Outcome signal_at(Time at) { return detail::signal_at(*core_, at); }
  void deactivate_at(Time at) { detail::deactivate_at(*core_, at); }
  // Throws arbiter::Error where the policy does not allow it: to ask before the first arrival.
  void require_replay() const { detail::require_replay(*core_); }

  // Says what stands behind the port, for people: `arbiter status` shows it, and `arbiter why` says
  // "/Nav/cmd:o comes from …". A phrase such as "DDS topic rt/cmd, no publisher matched", at most
  // 511 bytes; what is longer, or follows a zero byte, is cut; empty: nothing. The daemon hears it
  // at most four times a second, the last word always; so does the next daemon. Takes a lock and
  // allocates: call it when something has changed, off the data path. Any thread may call it while
  // the port is open.
  void describe(std::string_view text) noexcept { detail::describe(*core_, text, false); }
  // In its place, where something is wrong that somebody should mend: `arbiter why` marks it, and
  // `arbiter doctor` reports it.
  void describe_trouble(std::string_view text) noexcept { detail::describe(*core_, text, true); }

  // Whether another component waits for the port's name (OutputPortOptions::yields). Once true, it
  // stays true. Reads one word; any thread may call it while the port is open.
  [[nodiscard]] bool asked_to_yield() const noexcept { return detail::asked_to_yield(*core_); }

  // The port's name, which is also its source's.
  [[nodiscard]] const std::string& name() const noexcept { return detail::name(*core_); }
  // What a sample is; untyped: bytes.
  [[nodiscard]] const Type& type() const noexcept { return detail::type(*core_); }

 protected:
  explicit OutputPortBase(std::shared_ptr<detail::OutputCore> core) noexcept
      : core_(std::move(core)) {}

  template <class T>
  void require_own(const Loan<T>& loan) const {
    if (loan.core_ != nullptr && loan.core_.get() == core_.get()) return;
    throw std::invalid_argument("the loan is not one of this port");
  }
  // The loan's slot, which is the callee's from here on.
  template <class T>
  static std::uint32_t release(Loan<T>& loan) noexcept {
    static_cast<void>(loan.core_.release());
    return loan.core_.get_deleter().slot;
  }

  std::shared_ptr<detail::OutputCore> core_;
};

template <class T>
class OutputPort : public OutputPortBase {
  static_assert(std::is_same_v<T, std::remove_cv_t<T>>,
                "an output port writes its samples: give its type without const and volatile");

 public:
  // Memory for a sample; empty if max_loans are out. Not zeroed. Wait-free.
  [[nodiscard]] std::optional<Loan<T>> loan() noexcept {
    const detail::LoanedSlot slot = detail::loan(*core_, sizeof(T));
    if (slot.data == nullptr) return std::nullopt;
    if constexpr (std::is_default_constructible_v<T>) ::new (static_cast<void*>(slot.data)) T;
    return Loan<T>(*core_, slot);
  }
  // The arrival of a sample at all connected input ports: makes the source active, decides at each
  // port, and hands the sample to those where it wins. A loser wakes nobody. Wait-free; 50 ns and
  // up. Throws std::invalid_argument for a loan that is empty or another port's.
  Outcome publish(Loan<T> loan) {
    require_own(loan);
    return detail::publish(*core_, release(loan), sizeof(T));
  }
  // The same with a copy of `sample`.
  Outcome publish(const T& sample) noexcept {
    return detail::publish_copy(*core_, &sample, sizeof(T));
  }

  // The same, but never late: publish() first reads the clock, which gives the arrival's time. If
  // `deadline` has passed by then, there is no arrival: the source's activity stays as it was, no
  // sequence number is used, nobody is woken, and a loan is free again. The outcome says `late`,
  // and `arbiter status` counts it. (At the deadline itself a sample is in time.) Use it to pass on
  // samples that may have waited somewhere: one that is older than its T is better lost than
  // obeyed. The deadline says nothing about the time after that reading: a publisher that is
  // stopped inside publish() arrives when it continues, with the time that it has read.
  Outcome publish(Loan<T> loan, Time deadline) {
    require_own(loan);
    return detail::publish(*core_, release(loan), sizeof(T), deadline);
  }
  Outcome publish(const T& sample, Time deadline) noexcept {
    return detail::publish_copy(*core_, &sample, sizeof(T), deadline);
  }
  // The same, for a component that passes on samples from elsewhere: Sample::origin() and
  // TapEvent::origin() say where this one began, and recordings contain it. It is the component's
  // word, which nobody checks, and no decision depends on it.
  Outcome publish(Loan<T> loan, Time deadline, Origin origin) {
    require_own(loan);
    return detail::publish(*core_, release(loan), sizeof(T), deadline, origin);
  }

  // The sample of the last arrival, which was a signal(): for one that is fetched only where it is
  // wanted (wants_samples()). It is no arrival: the source's activity stays as it was. The sample
  // bears the time of the signal(), is decided for that time, as publish_at() is, and is handed to
  // the ports where the source wins. If `deadline` has passed, or the source is not active any
  // more, the outcome says `late`, and nothing happens. Call it once at most after each signal(),
  // with no publish() in between: nothing counts that. A second call, or one after a publish(),
  // hands over one more sample, which has the next sequence number and the time of that arrival.
  // Throws as publish(). Wait-free; but each call binds the rules again.
  Outcome publish_signalled(Loan<T> loan, Time deadline, Origin origin = {}) {
    require_own(loan);
    return detail::publish_signalled(*core_, release(loan), sizeof(T), deadline, origin);
  }

  // For replay: an arrival at a given time, as if publish() had been called then, had read the
  // clock, and had been held up until now. It is decided for `at`, the sample bears that time
  // (stamp_ns()), and the source is active until `at` + T, which may have passed already. So a
  // trace that is replayed in its order is decided as `arbiter simulate` says, however late each
  // call comes. If an arrival at another time, such as a live one, has come in between, it is
  // decided for the time of the call.
  //
  // Throws arbiter::Error if `at` is below 0, later than now, before the last arrival or
  // deactivation of this source, or at the time of a deactivation; or if the daemon's policy did
  // not allow this user to `replay` this source when the port was opened. Then there is no arrival,
  // and a loan is free again. The policy protects against mistakes only: a component writes the
  // activity of its own source, so a user who may open it can pretend any arrival. Wait-free; but
  // each call binds the rules again, which publish() does only after another model has come into
  // force.
  Outcome publish_at(Time at, Loan<T> loan) {
    require_own(loan);
    return detail::publish_at(*core_, at, release(loan), sizeof(T));
  }
  Outcome publish_at(Time at, const T& sample) {
    return detail::publish_copy_at(*core_, at, &sample, sizeof(T));
  }

 private:
  friend class Node;
  using OutputPortBase::OutputPortBase;
};

template <>
class OutputPort<void> : public OutputPortBase {
 public:
  // Memory for `size` bytes; empty if max_loans are out, or `size` is not what a sample may have:
  // that of its type, or for an untyped port or a variable type, up to max_size. Wait-free.
  [[nodiscard]] std::optional<Loan<void>> loan(std::size_t size) noexcept {
    if (!may_have(size)) return std::nullopt;
    const detail::LoanedSlot slot = detail::loan(*core_, size);
    if (slot.data == nullptr) return std::nullopt;
    return Loan<void>(*core_, slot, size);
  }
  // All as for a typed port. Throws std::invalid_argument, too, for a loan that was shrunk where a
  // type says how large samples are, and for bytes of a size that loan() would not give.
  Outcome publish(Loan<void> loan) {
    const std::size_t size = size_of(loan);
    return detail::publish(*core_, release(loan), size);
  }
  Outcome publish(Bytes bytes) {
    require_size(bytes.size());
    return detail::publish_copy(*core_, bytes.data(), bytes.size());
  }
  Outcome publish(Loan<void> loan, Time deadline) {
    const std::size_t size = size_of(loan);
    return detail::publish(*core_, release(loan), size, deadline);
  }
  Outcome publish(Loan<void> loan, Time deadline, Origin origin) {
    const std::size_t size = size_of(loan);
    return detail::publish(*core_, release(loan), size, deadline, origin);
  }
  Outcome publish(Bytes bytes, Time deadline) {
    require_size(bytes.size());
    return detail::publish_copy(*core_, bytes.data(), bytes.size(), deadline);
  }
  // The same, for a component that takes its own sample from `own`, an input port of the same node,
  // has the bytes anyway, and need not read them here: the loan is written only where anything else
  // may read it, another input port or a tap. Then publish() calls `write()`, once, before anybody
  // sees the sample. If it does not, what `own` takes has the sample's size, and whatever bytes
  // were there before. You may write them where the loan was as long as there has been no other
  // call on this port, and none has taken from `own`. `write`, such as a lambda, must not throw,
  // nor call this port. Costs a look at each connected port more.
  template <class Write>
  Published publish(Loan<void> loan, Time deadline, const InputPort<void>& own, Write&& write) {
    const std::size_t size = size_of(loan);
    using Called = std::remove_reference_t<Write>;
    const detail::LateBytes bytes{own.core_.get(),
                                  [](void* called) noexcept { (*static_cast<Called*>(called))(); },
                                  const_cast<std::remove_const_t<Called>*>(&write)};
    return detail::publish(*core_, release(loan), size, deadline, bytes);
  }
  Outcome publish_signalled(Loan<void> loan, Time deadline, Origin origin = {}) {
    const std::size_t size = size_of(loan);
    return detail::publish_signalled(*core_, release(loan), size, deadline, origin);
  }
  Outcome publish_at(Time at, Loan<void> loan) {
    const std::size_t size = size_of(loan);
    return detail::publish_at(*core_, at, release(loan), size);
  }
  Outcome publish_at(Time at, Bytes bytes) {
    require_size(bytes.size());
    return detail::publish_copy_at(*core_, at, bytes.data(), bytes.size());
  }
  // The largest sample, in bytes; where the port has a type of one size, that of each.
  [[nodiscard]] std::size_t max_size() const noexcept { return detail::max_size(*core_); }

 private:
  friend class Node;
  using OutputPortBase::OutputPortBase;

  [[nodiscard]] bool may_have(std::size_t size) const noexcept {
    return size == max_size() || (size < max_size() && !type().has_one_size());
  }
  [[nodiscard]] std::size_t size_of(const Loan<void>& loan) const {
    require_own(loan);
    require_size(loan.size());
    return loan.size();
  }
  void require_size(std::size_t size) const {
    if (may_have(size)) return;
    throw std::invalid_argument(name() + ": a sample of " + std::to_string(size) +
                                " bytes, but its type or max_size says " +
                                std::to_string(max_size()));
  }
};

}  // namespace arbiter
