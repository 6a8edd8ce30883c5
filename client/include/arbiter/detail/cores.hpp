// What the templates call: the compiled library behind them. Not for use by programs.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <arbiter/latencies.hpp>
#include <arbiter/options.hpp>
#include <arbiter/result.hpp>
#include <arbiter/type.hpp>

namespace arbiter::detail {

class InputCore;
class NodeCore;
class OutputCore;
class TapCore;

// In nanoseconds; saturating, so that wait_for(hours::max()) waits for ever rather than not at all.
template <class Rep, class Period>
std::int64_t saturated(std::chrono::duration<Rep, Period> timeout) noexcept {
  using Seconds = std::chrono::duration<double>;
  if (Seconds(timeout) > Seconds(std::chrono::hours(24 * 365))) return INT64_MAX;
  if (!(timeout > timeout.zero())) return 0;  // nor is NaN
  return std::chrono::duration_cast<std::chrono::nanoseconds>(timeout).count();
}

struct LoanedSlot {
  std::byte* data = nullptr;  // null: none to be had
  std::uint32_t slot = 0;
};

// Bytes of a sample that are written only where somebody but `knower` may read them.
struct LateBytes {
  const InputCore* knower;
  void (*write)(void* called) noexcept;
  void* called;
};

// What became of an arrival that was in time. Smaller than an Outcome by a word, which each publish
// would have to put together on its way out of several calls.
struct Counts {
  std::uint32_t delivered = 0;
  std::uint32_t discarded = 0;
  std::uint32_t refused = 0;

  operator Outcome() const noexcept {  // NOLINT: that is what it is for
    return {delivered, discarded, refused, false};
  }
};

// A sample that a component holds; `data` null: none.
struct HeldSample {
  const std::byte* data = nullptr;
  std::size_t size = 0;
  std::uint64_t sequence = 0;
  std::int64_t stamp_ns = 0;
  std::uint32_t source = 0;
  std::uint32_t hold = 0;  // index of the hold
};

enum class Waited : std::uint8_t { kSample, kIdle, kTimeout };

// What the events of a source have in common, until its destinations change.
struct TapContext {
  std::string source;
  Type type = Type::untyped(0);
  std::vector<std::string> destinations;  // names of input ports, by bit of the masks
};

// An event of a tap.
struct TapEventData {
  std::uint8_t kind = 0;  // as TapEventKind
  std::int64_t time_ns = 0;
  std::uint64_t sequence = 0;
  std::uint64_t generation = 0;
  std::int64_t activity = 0;  // as shm/activity.hpp has it
  std::uint64_t lost = 0;
  std::uint64_t accepted = 0, discarded = 0, refused = 0, blind = 0;
  std::uint64_t count = 0;  // of samples that were dropped or overtaken
  std::size_t size = 0;
  Origin origin;
  const std::byte* data = nullptr;  // null: no sample is held
  std::uint32_t hold = 0;
  std::shared_ptr<const TapContext> context;
};

std::shared_ptr<NodeCore> make_node(std::string_view name, const NodeOptions& options);
void drop_node(std::shared_ptr<NodeCore> node) noexcept;
void service(NodeCore& node);
int service_fd(const NodeCore& node) noexcept;
void switch_model(NodeCore& node, std::string_view name);

std::shared_ptr<OutputCore> open_output(NodeCore& node, std::string_view name, const Type& type,
                                        const OutputPortOptions& options);
void close_output(std::shared_ptr<OutputCore> core) noexcept;
LoanedSlot loan(OutputCore& core, std::size_t size) noexcept;
void end_loan(OutputCore& core, std::uint32_t slot) noexcept;
Counts publish(OutputCore& core, std::uint32_t slot, std::size_t size) noexcept;
Counts publish_copy(OutputCore& core, const void* data, std::size_t size) noexcept;
Counts signal(OutputCore& core) noexcept;
// With a deadline.
Outcome publish(OutputCore& core, std::uint32_t slot, std::size_t size, Time deadline) noexcept;
Outcome publish_copy(OutputCore& core, const void* data, std::size_t size, Time deadline) noexcept;
Outcome signal(OutputCore& core, Time deadline) noexcept;
// And with an origin.
Outcome publish(OutputCore& core, std::uint32_t slot, std::size_t size, Time deadline,
                Origin origin) noexcept;
Outcome signal(OutputCore& core, Time deadline, Origin origin) noexcept;
// And with bytes that nobody may have to write.
Published publish(OutputCore& core, std::uint32_t slot, std::size_t size, Time deadline,
                  const LateBytes& bytes) noexcept;
// For an arrival that was a signal.
Outcome publish_signalled(OutputCore& core, std::uint32_t slot, std::size_t size, Time deadline,
                          Origin origin) noexcept;
bool wants_samples(const OutputCore& core) noexcept;
// With a given time of arrival. Throw Error.
Counts publish_at(OutputCore& core, Time at, std::uint32_t slot, std::size_t size);
Counts publish_copy_at(OutputCore& core, Time at, const void* data, std::size_t size);
Counts signal_at(OutputCore& core, Time at);
void deactivate_at(OutputCore& core, Time at);
void require_replay(const OutputCore& core);
void deactivate(OutputCore& core) noexcept;
void describe(OutputCore& core, std::string_view text, bool is_trouble) noexcept;
bool asked_to_yield(const OutputCore& core) noexcept;
std::size_t max_size(const OutputCore& core) noexcept;
const std::string& name(const OutputCore& core) noexcept;
const Type& type(const OutputCore& core) noexcept;

std::shared_ptr<InputCore> open_input(NodeCore& node, std::string_view name, const Type& type,
                                      const InputPortOptions& options);
void close_input(std::shared_ptr<InputCore> core) noexcept;
HeldSample take(InputCore& core);
Waited wait(InputCore& core, std::int64_t timeout_ns, HeldSample& sample);
void give_back(InputCore& core, std::uint32_t hold) noexcept;
int wait_descriptor(InputCore& core);
void disarm(InputCore& core) noexcept;
void describe(InputCore& core, std::string_view text, bool is_trouble) noexcept;
std::optional<std::string_view> winner(InputCore& core) noexcept;
bool is_idle(InputCore& core) noexcept;
const std::string& source_name(const InputCore& core, std::uint32_t source) noexcept;
const Type& sample_type(const InputCore& core, std::uint32_t hold) noexcept;
Origin sample_origin(const InputCore& core, const HeldSample& held) noexcept;
std::int64_t believable_time(std::int64_t stamp_ns) noexcept;
const std::string& name(const InputCore& core) noexcept;
const Type& type(const InputCore& core) noexcept;

std::shared_ptr<TapCore> open_tap(NodeCore& node, std::string_view name, const Type& type,
                                  const TapOptions& options);
void close_tap(std::shared_ptr<TapCore> core) noexcept;
bool take(TapCore& core, TapEventData& event);
bool wait(TapCore& core, std::int64_t timeout_ns, TapEventData& event);
void give_back(TapCore& core, std::uint32_t hold) noexcept;
int wait_descriptor(TapCore& core);
const std::string& name(const TapCore& core) noexcept;
std::uint64_t lost_events(const TapCore& core) noexcept;
std::uint64_t lost_samples(const TapCore& core) noexcept;
Latencies latencies(TapCore& core);

// A sample, and a loan, keep the port's core in being without counting references to it: samples
// and loans are counted anyway, by their port's thread, where an atomic count would hold up each
// call until all that was stored before it has reached the cache.
struct GiveBack {
  void operator()(InputCore* core) const noexcept { give_back(*core, hold); }
  std::uint32_t hold = 0;
};
using HeldBy = std::unique_ptr<InputCore, GiveBack>;

struct GiveBackToTap {
  void operator()(TapCore* core) const noexcept { give_back(*core, hold); }
  std::uint32_t hold = 0;
};
using HeldByTap = std::unique_ptr<TapCore, GiveBackToTap>;

struct EndLoan {
  void operator()(OutputCore* core) const noexcept { end_loan(*core, slot); }
  std::uint32_t slot = 0;
};
using LoanedBy = std::unique_ptr<OutputCore, EndLoan>;

}  // namespace arbiter::detail
