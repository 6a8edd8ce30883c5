// A tap: take(), wait(), and what they need.
//
// Two threads meet here. The tap's thread takes and waits; the service thread learns of output
// ports, maps what they tell, and offers the result as a view.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <arbiter/detail/cores.hpp>

#include "client/handover.hpp"
#include "client/input/copies.hpp"
#include "client/peers.hpp"
#include "client/service_bell.hpp"
#include "client/tap/takes.hpp"
#include "shm/bell.hpp"
#include "shm/clock.hpp"
#include "shm/descendants.hpp"
#include "shm/destination_list.hpp"
#include "shm/event_ring.hpp"
#include "shm/tap_segment.hpp"

namespace arbiter::detail {

// An output port that tells a tap its events. What the foreign segment says of itself is read once,
// when it is mapped.
struct TapSource {
  std::string name;
  std::shared_ptr<const OutputPeer> output;
  shm::Mapping mapping;  // of the events
  std::optional<shm::Bequest> bequest;
  const shm::EventSegment* events = nullptr;
  shm::EventShape shape;
  shm::SegmentIdentity identity;  // of the events
  std::uint32_t place = 0;
  std::uint64_t link = 0;
  // Set by the tap's thread once a publisher that is gone has told all that it had to tell.
  mutable shm::Atomic<bool> drained{false};
  // And once it has told what cannot be read as an event: nothing is read from it any more.
  mutable shm::Atomic<bool> misbehaved{false};
};

// Maps what the daemon has announced, and checks it; `own`: what the tap takes. Throws
// std::runtime_error saying what is wrong, std::system_error.
std::shared_ptr<const TapSource> map_tap_source(const wire::Received& announced,
                                                const shm::TypeInfo& own, shm::Residence residence);

struct TapSourceLink {
  std::shared_ptr<const TapSource> source;
  bool gone = false;                     // closed or dead: drain it
  bool reported = false;                 // that it misbehaves
  std::uint32_t copied = 0;              // of the output peer's, when it was surveyed last
  std::optional<shm::ActivityWord> end;  // of one that is gone: its activity, by its page
};

// The input port that is tapped, while a component has it open.
struct TapInput {
  shm::PortInstance instance = 0;
  shm::SegmentIdentity identity;
  shm::Mapping mapping;
  std::optional<shm::Bequest> bequest;
  mutable std::optional<TakeWatch> watch;                       // tap's thread, once it is told
  std::array<std::uint64_t, shm::kLatencyBuckets> latencies{};  // what the port had counted before
  // Set by the tap's thread once all has been told of a port that is gone.
  mutable shm::Atomic<bool> drained{false};
};

// Maps what the daemon has announced, and checks it. Throws as map_tap_source().
std::shared_ptr<const TapInput> map_tap_input(const wire::Received& announced,
                                              shm::Residence residence);

struct TapInputLink {
  std::shared_ptr<const TapInput> input;
  bool gone = false;
};

struct TapSourceView {
  std::vector<TapSourceLink> links;
  std::vector<TapInputLink> inputs;
  TapSourceView* next_retired = nullptr;
};

class TapCore {
 public:
  // Makes and seals the segment, and the bell. Throws std::system_error.
  TapCore(std::string name, const Type& type, const TapOptions& options,
          std::shared_ptr<const ServiceBell> service_bell, shm::Residence residence);

  // Service thread.

  void bind(shm::PortInstance instance) noexcept { instance_ = instance; }
  void add_source(std::shared_ptr<const TapSource> source);
  // It has closed or died, or is not connected any more; what it has told can still be taken.
  // `activity`: of a source whose port is gone, what its page says.
  void lose_source(shm::PortInstance output, std::optional<shm::ActivityWord> activity);
  // The same of whoever had the source open.
  void lose_all_of(shm::SourceId source);
  // The same for the input port that is tapped.
  void add_input(std::shared_ptr<const TapInput> input);
  void lose_input(shm::PortInstance input);
  [[nodiscard]] std::vector<std::shared_ptr<const OutputPeer>> copied_from();
  // The names of those that have begun to misbehave, once each.
  std::vector<std::string> misbehaving();
  // Unmaps what the tap's thread has let go of.
  void tidy();

  // Tap's thread.

  // The next event; false: there is none. Throws Error where more samples are held than may be.
  bool take(TapEventData& event);
  bool wait(shm::Nanoseconds timeout, TapEventData& event);
  void give_back(std::uint32_t hold) noexcept;
  // Throws Error.
  int wait_descriptor();
  [[nodiscard]] Latencies latencies();
  [[nodiscard]] std::uint32_t held() const noexcept { return held_; }
  [[nodiscard]] std::uint64_t lost_events() const noexcept { return lost_events_; }
  [[nodiscard]] std::uint64_t lost_samples() const noexcept { return lost_samples_; }

  // Either.

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] const TapOptions& options() const noexcept { return options_; }
  [[nodiscard]] shm::PortInstance instance() const noexcept { return instance_; }
  [[nodiscard]] const shm::TypeInfo& type() const noexcept { return type_; }
  [[nodiscard]] const shm::FileDescriptor& segment_descriptor() const noexcept {
    return descriptor_;
  }
  [[nodiscard]] const shm::Bell& bell() const noexcept { return bell_; }

  shm::ProcessMark process;                 // the node's
  mutable pid_t warned_about = 0;           // the child that was told that the tap is not its own
  std::shared_ptr<NodeCore> node;           // kept for as long as the tap is
  std::shared_ptr<TapCore> kept_by_events;  // tap's thread: the tap is gone, they are not
  bool is_open = false;  // service thread, under the node's lock: its opening is over

 private:
  // A source as the tap's thread reads it.
  struct Stream {
    std::shared_ptr<const TapSource> source;
    bool gone = false;
    bool ended = false;            // all has been told, its end too
    bool has_begun = false;        // something of it has been taken
    std::uint32_t behind_end = 0;  // read since it has gone
    std::optional<shm::ActivityWord> end;
    shm::EventReader reader;
    bool has_head = false;
    bool head_is_end = false;
    shm::EventRecord head;
    std::uint64_t head_lost = 0;
    shm::EventRecord last;       // that was taken
    std::uint32_t taken = 0;     // of the round under way; a round is as many as the ring has
    shm::Nanoseconds round = 0;  // when it began
    shm::Nanoseconds since = 0;  // the round before: no live event of this one is older
    std::uint64_t revision = 0;  // of the list that context_ has
    std::shared_ptr<const TapContext> context;
  };

  // What has become of samples at the input port that is tapped, not taken yet.
  struct Take {
    shm::Nanoseconds seen = 0;
    TakeWatch::News news;
  };

  void offer_view();
  void accept_view();
  bool look_at(Stream& stream) noexcept;
  void end(Stream& stream) noexcept;
  void let_go(const Stream& stream) noexcept;
  void look_at_inputs();
  void fill(const Take& take, TapEventData& event);
  [[nodiscard]] bool is_honest(const Stream& stream) const noexcept;
  [[nodiscard]] bool has_credible_time(const Stream& stream) noexcept;
  [[nodiscard]] static bool has_credible_activity(const shm::EventRecord& head) noexcept;
  void disbelieve(Stream& stream) noexcept;
  static void be_state(shm::EventRecord& head) noexcept;
  void give_up(Stream& stream, std::uint64_t lost) noexcept;
  [[nodiscard]] bool has_predecessor(const Stream& stream) const noexcept;
  Stream* oldest() noexcept;
  [[nodiscard]] static shm::Nanoseconds order_of_head(const Stream& stream) noexcept;
  static void count_round(Stream& stream) noexcept;
  void fill(Stream& stream, TapEventData& event);
  void give_context(Stream& stream);
  [[nodiscard]] bool hold(Stream& stream, TapEventData& event) noexcept;
  [[nodiscard]] bool copy(const Stream& stream, std::uint32_t slot, TapEventData& event) noexcept;
  bool take_once(TapEventData& event);
  void arm() noexcept;
  void disarm() noexcept;
  void require_may_wait() const;

  const std::string name_;
  const TapOptions options_;
  const shm::TypeInfo type_;
  const std::shared_ptr<const ServiceBell> service_bell_;
  shm::FileDescriptor descriptor_;
  shm::Mapping mapping_;
  std::optional<shm::Bequest> bequest_;
  shm::TapSegment* const segment_;
  const shm::Bell bell_;
  shm::PortInstance instance_ = 0;

  // Service thread.
  std::multimap<shm::PortInstance, TapSourceLink> links_;
  std::multimap<shm::PortInstance, TapInputLink> inputs_;

  Handover<TapSourceView> handover_;

  // Tap's thread.
  std::unique_ptr<TapSourceView> view_;
  std::vector<Stream> streams_;
  shm::Nanoseconds reading_ = 0;       // of the clock, by which events are judged
  shm::Nanoseconds looked_ = 0;        // at the input port, the last time
  std::vector<TakeWatch::News> news_;  // of one look
  std::deque<Take> takes_;
  std::map<shm::SourceId, std::shared_ptr<const TapContext>> known_;  // sources that were streams
  std::array<std::shared_ptr<const TapSource>, shm::kMaxTapHeld> held_from_;
  std::uint32_t held_ = 0;
  Copies copies_;
  std::uint64_t lost_events_ = 0;
  std::uint64_t lost_samples_ = 0;
  bool has_descriptor_ = false;
};

}  // namespace arbiter::detail
