// Input ports: where data reaches a component, past the port's arbiter (paper, section III).
//
// Units: sizes in bytes, times in nanoseconds of CLOCK_MONOTONIC. Threads: use a port, and its
// samples, from one thread at a time. Blocking: only wait_for() blocks. Cost: take() needs no lock,
// no allocation and no system call (docs/benchmarks.md has its time), but for the first one after a
// connection has come or gone, or another model has come into force (docs/real-time.md);
// wait_for() sleeps in the kernel. Errors: take() and wait_for() throw arbiter::Error for more than
// max_held samples; other calls that throw say so.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <arbiter/bytes.hpp>
#include <arbiter/detail/cores.hpp>
#include <arbiter/result.hpp>
#include <arbiter/type.hpp>

namespace arbiter {

// A sample, read in place. It goes back when it leaves its scope; until then its memory is not
// reused. Use it on the port's thread. The port stays open while one of its samples is held.
class SampleBase {
 public:
  // The name of the output port it came from; valid while the port is open. Wait-free.
  [[nodiscard]] const std::string& source() const noexcept {
    return detail::source_name(*core_, held_.source);
  }
  // The source's own count of its samples, from 1, by its publisher: a successor begins again.
  [[nodiscard]] std::uint64_t sequence() const noexcept { return held_.sequence; }
  // The type of the output port it came from, even if the input port is untyped; valid while the
  // sample is held. Wait-free.
  [[nodiscard]] const Type& type() const noexcept {
    return detail::sample_type(*core_, core_.get_deleter().hold);
  }
  // Where it began if its publisher passed it on (OutputPort::publish() with an origin). Wait-free.
  [[nodiscard]] Origin origin() const noexcept { return detail::sample_origin(*core_, held_); }
  // When it arrived: CLOCK_MONOTONIC, in nanoseconds. Its publisher wrote that time; if it lies in
  // the future, this returns the time of the first call instead, so that a motor can stop by a
  // sample's age. Reads the clock, about 30 ns.
  [[nodiscard]] std::int64_t stamp_ns() const noexcept {
    return held_.stamp_ns = detail::believable_time(held_.stamp_ns);
  }
  // The same, as a point in time.
  [[nodiscard]] Time stamp() const noexcept { return Time(std::chrono::nanoseconds(stamp_ns())); }

 protected:
  SampleBase(detail::InputCore& core, const detail::HeldSample& held) noexcept
      : core_(&core, {held.hold}), held_(held) {}
  [[nodiscard]] const detail::HeldSample& held() const noexcept { return held_; }

 private:
  detail::HeldBy core_;
  mutable detail::HeldSample held_;
};

template <class T>
class Sample : public SampleBase {
 public:
  const T& operator*() const noexcept { return *get(); }
  const T* operator->() const noexcept { return get(); }
  [[nodiscard]] const T* get() const noexcept {
    return std::launder(reinterpret_cast<const T*>(held().data));
  }

 private:
  template <class>
  friend class InputPort;
  using SampleBase::SampleBase;
};

template <>
class Sample<void> : public SampleBase {
 public:
  const Bytes& operator*() const noexcept { return bytes_; }
  const Bytes* operator->() const noexcept { return &bytes_; }
  [[nodiscard]] const std::byte* data() const noexcept { return bytes_.data(); }
  [[nodiscard]] std::size_t size() const noexcept { return bytes_.size(); }

 private:
  template <class>
  friend class InputPort;
  Sample(detail::InputCore& core, const detail::HeldSample& held) noexcept
      : SampleBase(core, held), bytes_(held.data, held.size) {}

  Bytes bytes_;
};

enum class WaitStatus : std::uint8_t {
  sample,   // here it is
  idle,     // the port has become idle, see InputPort::idle(); reported once each time
  timeout,  // neither happened in time
};

// The result of wait_for(): converts to bool and dereferences as take()'s result.
template <class T>
class WaitResult {
 public:
  explicit operator bool() const noexcept { return sample_.has_value(); }
  [[nodiscard]] bool has_value() const noexcept { return sample_.has_value(); }
  Sample<T>& operator*() noexcept { return *sample_; }
  const Sample<T>& operator*() const noexcept { return *sample_; }
  Sample<T>* operator->() noexcept { return &*sample_; }
  const Sample<T>* operator->() const noexcept { return &*sample_; }

  [[nodiscard]] WaitStatus status() const noexcept { return status_; }
  [[nodiscard]] bool idle() const noexcept { return status_ == WaitStatus::idle; }
  [[nodiscard]] bool timed_out() const noexcept { return status_ == WaitStatus::timeout; }

 private:
  template <class>
  friend class InputPort;
  explicit WaitResult(WaitStatus status) noexcept : status_(status) {}
  explicit WaitResult(Sample<T> sample) noexcept
      : status_(WaitStatus::sample), sample_(std::move(sample)) {}

  WaitStatus status_;
  std::optional<Sample<T>> sample_;
};

// T = void: untyped; accepts anything and gives bytes. Movable; one that has been moved from may be
// assigned to and destroyed, and nothing else: no call checks for that.
template <class T = void>
class InputPort {
 public:
  InputPort(InputPort&&) noexcept = default;
  InputPort& operator=(InputPort&& other) noexcept {
    if (this != &other) {
      detail::close_input(std::move(core_));
      core_ = std::move(other.core_);
    }
    return *this;
  }
  ~InputPort() { detail::close_input(std::move(core_)); }

  // The oldest waiting sample whose connection is the winner now (with `keep`: the oldest one that
  // was accepted), or empty. Waiting samples that have been overridden since are dropped and
  // counted. Wait-free. Throws arbiter::Error if max_held samples are held already.
  [[nodiscard]] std::optional<Sample<T>> take() {
    const detail::HeldSample held = detail::take(*core_);
    if (held.data == nullptr) return std::nullopt;
    return Sample<T>(*core_, held);
  }

  // As take(), but blocks, without spinning, until there is a sample, the port becomes idle, or the
  // time has passed. Losing publishers do not wake it, nor do signals: a component that shall end
  // at one waits for a while at a time, or for fd() beside what tells it of the signal.
  template <class Rep, class Period>
  [[nodiscard]] WaitResult<T> wait_for(std::chrono::duration<Rep, Period> timeout) {
    detail::HeldSample held;
    switch (detail::wait(*core_, detail::saturated(timeout), held)) {
      case detail::Waited::kSample:
        return WaitResult<T>(Sample<T>(*core_, held));
      case detail::Waited::kIdle:
        return WaitResult<T>(WaitStatus::idle);
      case detail::Waited::kTimeout:
        break;
    }
    return WaitResult<T>(WaitStatus::timeout);
  }

  // For poll() and epoll: readable when there may be a sample, or the port may have become idle.
  // Then call take() until it returns nothing; that arms the descriptor again. The port owns it.
  // Throws arbiter::Error if the system has no descriptor left.
  [[nodiscard]] int fd() { return detail::wait_descriptor(*core_); }
  // For a thread that is about to publish what this port may get, and then takes from it itself,
  // until take() returns nothing, and then looks at idle(): publishers meanwhile save the system
  // call that makes the descriptor readable, and a thread that waits for that is not woken, not
  // even when the port becomes idle. Without those takes a sample may wait unnoticed; without that
  // look, the end of all commands. Wait-free.
  void disarm() noexcept { detail::disarm(*core_); }

  // The source of the connection that is selected now, unless the port is idle. At a port that is
  // not arbitrated nothing is selected. The name is valid while the port is open. Wait-free.
  [[nodiscard]] std::optional<std::string_view> winner() noexcept { return detail::winner(*core_); }
  // True if no connection is selected now; at a port that is not arbitrated, if none is active.
  // Also true while the selected connection cannot deliver: it is refused (NoticeKind::refused); or
  // its source stays active for ever, or for longer than T, no component has it open, and none of
  // its samples waits. Behaviours that it inhibits stay inhibited. Wait-free.
  [[nodiscard]] bool idle() noexcept { return detail::is_idle(*core_); }
  // Says where what is taken goes, for people: "/Base/cmd:i goes to …". As
  // OutputPort::describe().
  void describe(std::string_view text) noexcept { detail::describe(*core_, text, false); }
  // As OutputPort::describe_trouble().
  void describe_trouble(std::string_view text) noexcept { detail::describe(*core_, text, true); }
  [[nodiscard]] const std::string& name() const noexcept { return detail::name(*core_); }
  // What it takes; untyped: anything.
  [[nodiscard]] const Type& type() const noexcept { return detail::type(*core_); }

 private:
  friend class Node;
  template <class>
  friend class OutputPort;
  explicit InputPort(std::shared_ptr<detail::InputCore> core) noexcept : core_(std::move(core)) {}

  std::shared_ptr<detail::InputCore> core_;
};

}  // namespace arbiter
