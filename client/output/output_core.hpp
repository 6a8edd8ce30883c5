// An output port: publish(), and what it needs.
//
// Two threads meet here. The port's thread publishes; the service thread (or whoever services the
// node) learns of input ports, maps them, allocates memory, and offers the result as a view.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <arbiter/detail/cores.hpp>

#include "client/handover.hpp"
#include "client/memory.hpp"
#include "client/output/events.hpp"
#include "client/peers.hpp"
#include "shm/channel.hpp"
#include "shm/clock.hpp"
#include "shm/descendants.hpp"
#include "shm/output_segment.hpp"
#include "shm/slot_pool.hpp"

namespace arbiter::detail {

class OutputCore {
 public:
  // Makes and seals the segment. Throws std::system_error.
  OutputCore(std::string name, const Type& type, const OutputPortOptions& options,
             std::shared_ptr<SharedMemory> memory);
  OutputCore(const OutputCore&) = delete;
  OutputCore& operator=(const OutputCore&) = delete;
  // All loans are over. In the process that made it; a child never destroys its copy.
  ~OutputCore();

  // What max_memory must be at least: the loans, a copy, and the smallest queue.
  static std::uint64_t least_memory(const shm::TypeInfo& type, std::uint32_t max_loans);

  // Service thread.

  // The port is open: the daemon has given it its place.
  void bind(shm::PortInstance instance, shm::SourceId source, shm::FileDescriptor page);
  // Before the component has the port: `why`, a sentence of the daemon's, and empty of one that
  // does not know what replay is.
  void forbid_replay(std::string why) {
    why_no_replay_ = why.empty() ? "this daemon does not allow replay" : std::move(why);
  }
  // `link`: its number if they are connected, else 0.
  void add_peer(std::shared_ptr<const InputPeer> peer, std::uint64_t link);
  void remove_peer(shm::PortInstance peer);
  void disconnect_peer(shm::PortInstance peer);
  // The connection is refused: its arrivals are counted as that, be the peer mapped or not.
  void refuse_peer(shm::PortInstance peer, shm::PortId port, std::string_view name);
  [[nodiscard]] std::vector<HeldLink> held_links() const;
  // What a tap is to be told: where it reads, and what. Throws std::runtime_error where it does not
  // fit, std::system_error where there is no memory.
  struct TapEntry {
    std::uint32_t place = 0;
    std::uint64_t link = 0;
    std::shared_ptr<const EventMemory> memory;
  };
  TapEntry add_tap(std::shared_ptr<const TapPeer> tap);
  void remove_tap(shm::PortInstance tap);
  // A tap whose conversation is lost lives, as far as anybody knows: it is heeded until its program
  // has gone. All of them: another daemon has come, which does not know them yet.
  void doubt_tap(shm::PortInstance tap) { taps_.doubt(tap); }
  void doubt_taps() { taps_.doubt_all(); }
  void end_tap(shm::PortInstance tap) { taps_.end(tap); }
  [[nodiscard]] bool has_doubtful_taps() const { return taps_.has_doubtful(); }
  // Whether a decision has missed a source that it could not see, for the first time.
  [[nodiscard]] bool has_become_blind() noexcept { return blindness_.is_news(); }
  // Unmaps what the port's thread has let go of.
  void tidy();
  // Those that have begun to misbehave; they are disconnected.
  std::vector<shm::PortInstance> misbehaving();
  // Those that have waited for a queue and got none for want of memory, each once, with the reason.
  using Refusal = std::pair<std::shared_ptr<const InputPeer>, std::string>;
  std::vector<Refusal> short_of_memory() { return std::exchange(short_of_memory_, {}); }

  // Port's thread.

  [[nodiscard]] LoanedSlot loan(std::size_t size) noexcept;
  void end_loan(std::uint32_t slot) noexcept;
  [[nodiscard]] std::uint32_t loans() const noexcept { return loans_; }
  // Arrivals at `now`, a reading of the clock.
  Counts publish_loan(std::uint32_t slot, std::size_t size, shm::Nanoseconds now) noexcept;
  Counts publish_copy(const void* data, std::size_t size, shm::Nanoseconds now) noexcept;
  Counts signal(shm::Nanoseconds now) noexcept;
  void deactivate(shm::Nanoseconds now) noexcept;
  // The same unless `deadline` has passed by `now`. Then nothing has happened: no word that others
  // read is written but the count of those that came late, and a loan is free again.
  Outcome publish_loan_by(shm::Nanoseconds deadline, std::uint32_t slot, std::size_t size,
                          shm::Nanoseconds now) noexcept;
  Outcome publish_copy_by(shm::Nanoseconds deadline, const void* data, std::size_t size,
                          shm::Nanoseconds now) noexcept;
  Outcome signal_by(shm::Nanoseconds deadline, shm::Nanoseconds now) noexcept;
  // The same with an arrival that began elsewhere.
  Outcome pass_on_loan(shm::SampleOrigin origin, shm::Nanoseconds deadline, std::uint32_t slot,
                       std::size_t size, shm::Nanoseconds now) noexcept;
  Outcome pass_on_signal(shm::SampleOrigin origin, shm::Nanoseconds deadline,
                         shm::Nanoseconds now) noexcept;
  // The same with bytes that are written now, unless `knower` alone is handed them. 0: nobody.
  Published publish_late_bytes(const LateBytes& bytes, shm::PortInstance knower,
                               shm::Nanoseconds deadline, std::uint32_t slot, std::size_t size,
                               shm::Nanoseconds now) noexcept;
  // The sample of the last arrival, which was a signal: as OutputPort::publish_signalled().
  Outcome publish_signalled(shm::SampleOrigin origin, shm::Nanoseconds deadline, std::uint32_t slot,
                            std::size_t size, shm::Nanoseconds now) noexcept;
  // As OutputPort::wants_samples().
  [[nodiscard]] bool wants_samples() const noexcept;
  // For replay: the next call of those above may be given the time `at`, as if it had read the
  // clock then and had been held up until `now`. Throws Error.
  void begin_replay(shm::Nanoseconds at, shm::Nanoseconds now);
  // Behind it: nobody saw anything begin at that time.
  void end_replay() noexcept { activity_->forget_beginning(); }
  // Throws Error where the policy does not allow replay.
  void require_replay() const;

  // Either.

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] bool yields() const noexcept { return yields_; }
  // Relaxed is enough: nothing else is read by it. The service thread alone writes it.
  [[nodiscard]] bool asked_to_yield() const noexcept {
    return asked_to_yield_.load(std::memory_order_relaxed);
  }
  void ask_to_yield() noexcept { asked_to_yield_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] shm::PortInstance instance() const noexcept { return instance_; }
  [[nodiscard]] shm::SourceId source() const noexcept { return source_; }
  [[nodiscard]] const shm::TypeInfo& type() const noexcept { return type_; }
  [[nodiscard]] const Type& declared_type() const noexcept { return declared_type_; }
  [[nodiscard]] const shm::FileDescriptor& segment_descriptor() const noexcept { return readable_; }
  [[nodiscard]] const shm::FileDescriptor& page_descriptor() const noexcept {
    return page_descriptor_;
  }
  [[nodiscard]] const SharedMemory& memory() const noexcept { return *memory_; }

  // To write samples of so many bytes takes longer than to look at what receivers are done with: a
  // few lines that others write, and a walk through their holds. Nobody changes it but the
  // explorer, whose samples are small.
  std::size_t smallest_large = std::size_t{32} << 10;
  shm::ProcessMark process;        // the node's
  mutable pid_t warned_about = 0;  // the child that was told that the port is not its own
  std::shared_ptr<NodeCore>
      node;  // kept for as long as the port is, so that they may go in any order
  std::shared_ptr<OutputCore> kept_by_loans;  // port's thread: the port is gone, they are not

 private:
  // How often a decision is taken anew because seven models were loaded during it.
  static constexpr int kMaxTableRetries = 3;

  // As an epoch, of a table by which no decision counts.
  static constexpr shm::Epoch kNotInForce = UINT64_MAX;

  // As last_, before this port's first arrival: a predecessor's.
  static constexpr shm::Nanoseconds kUnknown = -1;

  // A link as the port's thread works with it.
  struct Destination {
    const InputPeer* peer = nullptr;  // kept alive by view_
    bool joined = false;   // it has a queue of ours; else it senses, or holds old samples
    bool awaited = false;  // it is to have one (join_awaited())
    bool refused = false;  // it would have, but for its type
    std::uint64_t link = 0;
    std::uint32_t channel = shm::kNone;
    std::uint32_t depth = 1;   // of the queue
    std::uint64_t missed = 0;  // samples that were discarded before the queue began
    shm::ChannelWriter writer;
    bool has_rule = false;  // the connection, under bound_epoch_
    std::uint32_t decision = 0;
    shm::Verdict verdict = shm::Verdict::kLoses;
    std::uint64_t rung = 0;           // the wait that we rang for last
    const shm::Lane* lane = nullptr;  // ours in the peer's segment, once found
    std::uint64_t mask = 0;           // its bit in the masks of events
  };

  void assign_channel(InputLink& link);
  void allocate_slots();
  [[nodiscard]] shm::Destinations number_destinations();
  void connect_waiting(InputLink& link);
  void offer_view();
  void accept_view() noexcept;
  void leave_all_but(const OutputView& view) noexcept;
  static void join(Destination& destination) noexcept;
  void join_awaited() noexcept;
  // All is taken up: the view, the rules in force, and what they decide for each destination.
  [[nodiscard]] bool is_settled() const noexcept;
  void settle() noexcept;
  [[nodiscard]] bool rules_are_bound() const noexcept;
  void bind_rules() noexcept;
  void bind_rules_and_view() noexcept;
  void rebind_view() noexcept;
  void bind_table() noexcept;
  void read_table() noexcept;
  void bind_decisions() noexcept;

  Outcome be_late() noexcept;
  // Stamps it. True: the source's activity begins with it.
  inline bool begin_arrival(shm::Nanoseconds now) noexcept;
  // With the sample in `slot`, or without one (kNoSlot).
  Counts arrive(std::uint32_t slot, std::size_t size, shm::Nanoseconds now) noexcept;
  void stamped(shm::ActivityWord word) noexcept;  // what the page says now
  void decide_all(shm::Nanoseconds now) noexcept;
  void decide_anew(shm::Nanoseconds now) noexcept;
  void decide_by(shm::DecisionClock clock) noexcept;
  Counts hand_over(std::uint32_t slot, std::size_t size, shm::Nanoseconds now) noexcept;
  [[nodiscard]] shm::EventRecord state() const noexcept;
  [[nodiscard]] shm::Masks masks() noexcept;
  // The same for a port that is tapped, from the decision on.
  Counts hand_over_and_tell(std::uint32_t slot, std::size_t size, bool begins) noexcept;
  void tell_arrival(std::uint32_t slot) noexcept;
  void tell_deactivation() noexcept;
  [[nodiscard]] Counts refuse(const Destination& destination, bool is_sample) const noexcept;
  [[nodiscard]] Counts pass_over(Destination& destination, bool is_sample) noexcept;
  [[nodiscard]] const shm::Lane* lane_of(Destination& destination) const noexcept;
  [[nodiscard]] bool is_full(Destination& destination) const noexcept;
  // Whether the arrival under way is handed to anybody but that receiver.
  [[nodiscard]] bool wins_beside(shm::PortInstance receiver) const noexcept;
  static void ring_if_waiting(Destination& destination) noexcept;
  void ring_where_selection_changed() noexcept;
  [[nodiscard]] bool selection_differs(const Destination& destination) noexcept;
  // For a sample of that many bytes.
  std::uint32_t acquire_slot(std::size_t size) noexcept;
  // Retires what all receivers are done with.
  void forget_consumed() noexcept;

  // Constant once bound.
  const std::string name_;
  const Type declared_type_;
  const shm::TypeInfo type_;  // the same, as it lies in memory
  const std::uint32_t max_loans_;
  const std::shared_ptr<SharedMemory> memory_;
  const std::uint32_t slots_of_components_;  // that max_memory allows
  const std::uint32_t slots_of_taps_;        // beside them
  shm::FileDescriptor descriptor_;
  shm::FileDescriptor readable_;  // for others: the daemon passes it on as it is
  shm::Mapping mapping_;
  std::optional<shm::Bequest> bequest_;
  shm::OutputSegment segment_;
  shm::PortInstance instance_ = 0;
  shm::SourceId source_ = shm::kNone;
  shm::FileDescriptor page_descriptor_;  // for a daemon that takes over
  shm::Mapping page_;
  std::optional<shm::Bequest> page_bequest_;
  shm::Activity* activity_ = nullptr;
  std::string why_no_replay_;  // empty: it is allowed

  // Service thread.
  std::map<shm::PortInstance, InputLink> links_;
  TapSeats taps_;
  std::vector<Refusal> short_of_memory_;
  std::uint32_t allocated_slots_ = 0;
  const bool yields_;
  shm::Atomic<bool> asked_to_yield_{false};

  Handover<OutputView> handover_;
  Blindness blindness_;

  // Port's thread.
  std::unique_ptr<OutputView> view_;
  std::vector<Destination> destinations_;
  // Connections whose rules are the same are decided together.
  struct SharedDecision {
    shm::Rule rule;
    shm::BoundRule bound;
    shm::Verdict verdict = shm::Verdict::kLoses;
  };
  std::vector<SharedDecision> decisions_;
  std::vector<shm::Read> reads_;  // what decisions_ have bound
  shm::SlotPool pool_;
  EventTeller teller_;
  std::uint32_t loans_ = 0;
  std::uint64_t sequence_ = 0;
  shm::SampleOrigin origin_;  // of the arrival under way, where it began elsewhere
  shm::ActivityWord own_word_ = shm::kNeverActive;
  shm::Nanoseconds last_ = kUnknown;  // time of the last arrival or deactivation
  shm::Epoch bound_epoch_ = UINT64_MAX;
  shm::Epoch settled_epoch_ = UINT64_MAX;  // the same, unless a destination is awaited
  bool has_awaited_ = false;
  std::uint64_t bound_pages_ = 0;
  shm::TableSnapshot snapshot_;
  shm::Nanoseconds timeout_ = shm::kDefaultTimeout;
};

}  // namespace arbiter::detail
