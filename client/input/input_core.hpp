// An input port: take(), wait_for(), and what they need.
//
// Two threads meet here. The port's thread takes and waits; the service thread learns of output
// ports, maps them, and offers the result as a view.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <arbiter/detail/cores.hpp>

#include "client/handover.hpp"
#include "client/input/copies.hpp"
#include "client/memory.hpp"
#include "client/peers.hpp"
#include "shm/bell.hpp"
#include "shm/channel.hpp"
#include "shm/clock.hpp"
#include "shm/descendants.hpp"
#include "shm/input_segment.hpp"
#include "shm/port_picture.hpp"

namespace arbiter::detail {

class InputCore {
 public:
  // Makes and seals the segment, and the bell. Throws std::system_error.
  InputCore(std::string name, const Type& type, const InputPortOptions& options,
            std::shared_ptr<SharedMemory> memory);
  InputCore(const InputCore&) = delete;
  InputCore& operator=(const InputCore&) = delete;
  // All samples are given back. In the process that made it; a child never destroys its copy.
  ~InputCore();

  // Service thread.

  void bind(shm::PortInstance instance, shm::PortId port);
  void add_peer(std::shared_ptr<const OutputPeer> peer);
  // Null: it is not known.
  [[nodiscard]] std::shared_ptr<const OutputPeer> peer(shm::PortInstance instance) const;
  // Those of whom samples had to be copied since this was asked last: they may have grown.
  [[nodiscard]] std::vector<std::shared_ptr<const OutputPeer>> copied_from();
  // The peer has closed or died; what it has delivered can still be taken.
  void lose_peer(shm::PortInstance peer);
  // The model has disconnected it.
  void disconnect_peer(shm::PortInstance peer);
  // Its connection is refused: nothing of the source comes while this peer has it open.
  void refuse_peer(shm::PortInstance peer, shm::SourceId source);
  [[nodiscard]] std::vector<HeldLink> held_links() const;
  // Unmaps what the port's thread has let go of, and what nobody will take any more.
  void tidy();
  // Whether a publisher that is gone has left samples, which a later tidy() may let go of.
  [[nodiscard]] bool has_predecessors() const noexcept;
  // Those that have begun to misbehave, once each. Nothing is taken from them any more.
  std::vector<shm::PortInstance> misbehaving();
  // Whether a take has missed a source that it could not see, for the first time.
  [[nodiscard]] bool has_become_blind() noexcept { return blindness_.is_news(); }

  // Whether takes count how long their samples have waited. Relaxed: it orders nothing.
  void set_measured(bool measured) noexcept {
    is_measured_.store(measured, std::memory_order_relaxed);
  }

  // Port's thread.

  HeldSample take();
  Waited wait(shm::Nanoseconds timeout, HeldSample& sample);
  void give_back(std::uint32_t hold) noexcept;
  int wait_descriptor();
  // Nobody rings until a take has found nothing. Nothing to do where there is no descriptor.
  void disarm_descriptor() noexcept;
  [[nodiscard]] std::optional<std::string_view> winner() noexcept;
  [[nodiscard]] bool is_idle() noexcept;
  [[nodiscard]] std::uint32_t held() const noexcept { return held_; }
  // Of a sample that is held. It stays until that is given back.
  [[nodiscard]] const Type& type_of_held(std::uint32_t hold) const noexcept {
    return held_from_[hold]->type;
  }

  [[nodiscard]] shm::SampleOrigin origin_of(const HeldSample& held) const noexcept;

  // Either.

  [[nodiscard]] shm::PortId port() const noexcept { return port_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] shm::PortInstance instance() const noexcept { return instance_; }
  [[nodiscard]] const shm::TypeInfo& type() const noexcept { return type_; }
  [[nodiscard]] const Type& declared_type() const noexcept { return declared_type_; }
  [[nodiscard]] const shm::FileDescriptor& segment_descriptor() const noexcept {
    return descriptor_;
  }
  [[nodiscard]] const shm::Bell& bell() const noexcept { return bell_; }
  [[nodiscard]] const SharedMemory& memory() const noexcept { return *memory_; }

  shm::ProcessMark process;        // the node's
  mutable pid_t warned_about = 0;  // the child that was told that the port is not its own
  std::shared_ptr<NodeCore>
      node;  // kept for as long as the port is, so that they may go in any order
  std::shared_ptr<InputCore> kept_by_samples;  // port's thread: the port is gone, they are not

 private:
  // A link as the port's thread works with it: one publisher's queue.
  struct Queue {
    std::shared_ptr<const OutputPeer> peer;
    bool gone = false;
    shm::ChannelReader reader;
    shm::Lane* lane = nullptr;
    shm::Rule connection;                // the connection's rule, under snapshot_
    shm::BoundRule rule;                 // the same
    const shm::Activity* own = nullptr;  // its source's; null: it has no page here
    std::uint32_t allocated_slots = 0;   // of the peer's, when it was last looked at
    // Of the take under way.
    shm::Entry head = 0;
    shm::Nanoseconds head_stamp = 0;
    std::uint64_t end = 0;  // sequence of the newest entry when the take looked
    shm::Verdict verdict = shm::Verdict::kLoses;
  };

  void offer_view();
  bool offer_links();
  void take_up(std::uint64_t link) noexcept;
  void accept_view();
  shm::Lane* free_lane() noexcept;
  void retire_queue(Queue& queue, const InputView& next);
  void bind_rules();
  void refresh();

  // take() in parts: look at the queues, decide, hold.
  [[nodiscard]] bool nothing_is_new() const noexcept;
  Queue* look() noexcept;
  Queue* scan(bool& again) noexcept;
  bool look_at(std::size_t index) noexcept;
  bool look_closely(Queue& queue) noexcept;
  void join(Queue& queue) noexcept;
  void look_for_queue(Queue& queue) noexcept;
  void drop_missed(Queue& queue) noexcept;
  void yield_to_successor(Queue& queue) noexcept;
  enum class Choice : std::uint8_t { kTake, kNothing, kAgain, kLoses };
  Choice choose(Queue*& oldest) noexcept;
  Choice decide_alone(Queue& queue) noexcept;
  Choice be_blind() noexcept;
  Choice choose_among_all(Queue*& chosen) noexcept;
  bool decide_all() noexcept;
  void drop_losers(const Queue* winner) noexcept;
  bool hold(Queue& queue, HeldSample& sample) noexcept;
  [[nodiscard]] std::uint32_t free_hold() const;
  [[nodiscard]] bool is_allocated(Queue& queue, std::uint32_t slot) const noexcept;
  [[nodiscard]] bool copy(const Queue& queue, std::uint32_t slot, HeldSample& sample) noexcept;
  void consume(Queue& queue) noexcept;
  void count_overtaken(Queue& queue, std::uint64_t lost) noexcept;
  void let_go_of(const OutputPeer* peer) noexcept;

  [[nodiscard]] shm::Command who_commands() noexcept;
  [[nodiscard]] bool can_deliver(const shm::Rule& rule) noexcept;
  [[nodiscard]] bool is_refused(shm::SourceId source) const noexcept;
  [[nodiscard]] bool ends_by_itself(shm::SourceId source) const noexcept;

  // wait() in parts.
  Waited wait_once(shm::Nanoseconds timeout, HeldSample& sample);
  bool arm(HeldSample& sample, shm::Command& command);
  bool arm_again(HeldSample& sample);
  [[nodiscard]] bool believes_last_taken() const noexcept;
  void wait_anew() noexcept;
  void disarm() noexcept;
  void stop_waiting() noexcept;
  void arm_descriptor(HeldSample& sample);
  void set_timer(shm::Nanoseconds change_at) noexcept;
  HeldSample take_once();
  void measure(shm::Nanoseconds stamp) const noexcept;

  // Constant once bound.
  const std::string name_;
  const Type declared_type_;
  const shm::TypeInfo type_;      // the same, as it lies in memory
  const std::uint64_t one_size_;  // of all samples; 0: each has its own
  const std::uint32_t max_held_;
  const bool keep_;
  const std::shared_ptr<SharedMemory> memory_;
  shm::FileDescriptor descriptor_;
  shm::Mapping mapping_;
  std::optional<shm::Bequest> bequest_;
  shm::InputSegment* segment_ = nullptr;
  shm::Bell bell_;
  shm::PortInstance instance_ = 0;
  shm::PortId port_ = shm::kNone;

  // Service thread.
  std::map<shm::PortInstance, OutputLink> links_;
  std::uint64_t let_go_ = 0;                            // as InputView::let_go
  std::map<shm::PortInstance, shm::SourceId> refused_;  // peers that are not among links_

  Handover<InputView> handover_;
  Blindness blindness_;

  // By the service thread, read by the port's.
  shm::Atomic<bool> is_measured_{false};

  // Port's thread.
  std::unique_ptr<InputView> view_;
  std::uint64_t counted_let_go_ = 0;
  std::vector<Queue> queues_;
  std::vector<shm::ChannelReader::Watch> watches_;  // by queue: what says that nothing is new
  std::vector<Queue*> waiting_;  // those in which the take under way found a head
  static constexpr std::size_t kNoQueue = SIZE_MAX;
  std::size_t last_taken_ = kNoQueue;        // of queues_, the last sample's
  shm::Nanoseconds last_stamp_ = INT64_MIN;  // the last sample's
  bool selects_one_ = false;                 // at most, under snapshot_: the port is arbitrated
  shm::TableSnapshot snapshot_;
  shm::Epoch bound_epoch_ = UINT64_MAX;
  std::uint64_t bound_pages_ = 0;
  std::vector<shm::Read> reads_;       // what the queues' rules have bound
  shm::PortPicture picture_;           // of all sources that the port heeds, under snapshot_
  shm::Nanoseconds last_reading_ = 0;  // of the clock, by this port
  std::uint32_t held_ = 0;
  std::array<const OutputPeer*, shm::kMaxHeld> held_from_{};  // by hold
  Copies copies_;                                             // likewise
  // Publishers that are gone and of whom samples are held: kept mapped, each in a view of its own.
  std::vector<std::unique_ptr<InputView>> lingering_;
  bool commanded_ = false;  // a commander was seen, or a sample taken, since idle was last told
  shm::FileDescriptor epoll_;
  shm::FileDescriptor timer_;
  bool is_disarmed_ = false;                   // by disarm_descriptor(), until it is armed again
  shm::Nanoseconds timer_at_ = shm::kForever;  // when it expires; what is set is never later
};

}  // namespace arbiter::detail
