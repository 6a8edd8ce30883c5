// What this host offers to others: a writer for each output port that a component has open here,
// and a tap of it while somebody reads it. A source that nobody wants costs its publisher nothing.
//
// A tap is no destination: exporting changes no decision and holds up no publisher. Its events
// leave in their order, on one thread, which waits for no reader, but keeps a pace where they are
// large (core/train_pace.hpp). What the tap or the network loses uses numbers, so that importers
// count it. Where an event cannot be written, the state of its source is said until it is. A sample
// that all importers can do without stays here, until one of them wants it (core/demand.hpp).
//
// Thread safety: look() on the link's thread; sending has a thread of its own, which shares
// exports_ under mutex_. To send takes as long as the network does: an export whose turn it is
// belongs to the sending thread, without the lock, and the link's thread passes it over until
// another look. Nor are taps opened and closed under the lock. A publisher that never rests keeps
// the sending thread locking: gate_ gives the link's thread its turn.
#pragma once

#include <sys/epoll.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include <arbiter/node.hpp>
#include <arbiter/tap.hpp>

#include "link/core/demand.hpp"
#include "link/core/event_header.hpp"
#include "link/core/held_tokens.hpp"
#include "link/core/kept_sample.hpp"
#include "link/core/patience.hpp"
#include "link/core/rush.hpp"
#include "link/dds/datagram_train.hpp"
#include "link/dds/demands.hpp"
#include "link/dds/event_topic.hpp"
#include "link/host_view.hpp"
#include "shm/file_descriptor.hpp"
#include "shm/type_info.hpp"

namespace arbiter::link {

class Exports {
 public:
  // `incarnation` of this link, from which each export has one of its own. `bell` rings where
  // look() has something to do. Keeps references. Throws std::system_error.
  Exports(Node& node, const Network& network, const HeldTokens& tokens, std::string host,
          Incarnation incarnation, const gateway::Bell& bell);
  Exports(const Exports&) = delete;
  Exports& operator=(const Exports&) = delete;
  ~Exports();

  // From now on exactly the sources are offered that components of this host have open. Taps those
  // of them that are wanted elsewhere, and nothing else.
  void look(const HostView& view, const Patience& patience);

 private:
  struct Export {
    Export(const Network& network, OfferCard of, const gateway::Bell& bell)
        : card(std::move(of)), writer(network, card, bell) {}
    OfferCard card;
    EventWriter writer;
    std::optional<Tap<void>> tap;
    std::uint64_t number = 0;          // of the last event
    std::uint64_t sequence = 0;        // of the last sample
    bool is_deactivated = false;       // by the last event
    bool is_unsaid = false;            // that event was not written
    std::size_t written = 0;           // bytes of the sample that the writer keeps
    bool is_wanted = false;            // by anybody
    Demand demand = Demand::kSamples;  // of those who read it
    std::uint32_t reader_changes = 0;  // that `demand` knows of
    KeptSample kept;                   // the last event's, where it was withheld
    std::string said;                  // why it cannot be tapped
    bool has_said_unknown = false;     // that its type cannot be made known
    shm::Nanoseconds tap_again = 0;    // not before
  };

  void withdraw(const HostView::OpenPorts& ports, const Patience& patience);
  void offer(const std::string& source, const shm::TypeInfo& type);
  // Of the export with that id. What is offered again begins a stream of its own, whose numbers and
  // types have nothing to do with those before.
  [[nodiscard]] Incarnation incarnation_of(std::uint64_t id) const noexcept;
  void tap_what_is_wanted(const HostView& view, const Patience& patience);
  void open_tap(Export& one, std::uint64_t id, const HostView& view);
  void close_tap(Export& one, std::uint64_t id);
  // Of what epoll_wait() names, beside exports.
  static constexpr std::uint64_t kWakeId = 0;
  static constexpr std::uint64_t kReadersId = ~std::uint64_t{0};
  static constexpr int kMostEvents = 64;  // that are heard at once
  void run();
  // As epoll_wait(), but stays awake in a rush.
  int await_events(std::array<epoll_event, kMostEvents>& events, int milliseconds) const noexcept;
  void wake() const noexcept;
  // mutex_, for the link's thread: before the sending thread has it again.
  [[nodiscard]] std::unique_lock<std::mutex> lock_first();
  // Likewise for the sending thread: after the link's.
  [[nodiscard]] std::unique_lock<std::mutex> lock_after();
  // Takes up what epoll_wait() says, and who has a turn; false: it is over.
  bool take_up(const epoll_event* events, int count);
  void take_turn(std::uint64_t id);
  // Null: there is nothing to be sent of it. Else it is the sending thread's until end_turn().
  [[nodiscard]] Export* begin_turn(std::uint64_t id);
  void end_turn(bool is_left);
  // From here on: of the export whose turn it is, or under mutex_.
  bool send_some(Export& one);
  void state(Export& one, bool is_deactivated);
  // Says the state of those whose last event was not written, and of those whose last sample nobody
  // reads any more. True: one is left.
  bool say_unsaid();
  // In the place of the sample that the writer keeps for who comes later.
  void drop_sample(Export& one);
  void write(Export& one, Bytes sample);
  // As write(), of an event that has its number already.
  [[nodiscard]] bool put(Export& one, Bytes sample);
  // Returns the bytes of the sample that has been sent.
  std::size_t send(Export& one, const TapEvent<void>& event);
  // Whose readers have come, gone, or said something else. True: one has come or gone.
  bool hear_readers();
  void hear_readers(std::uint64_t id, Export& one);
  void send_kept(Export& one);
  // False: the type cannot be made known now, and importers would take its samples for others.
  static bool know_type(Export& one, const shm::TypeInfo& type);

  Node& node_;
  const Network& network_;
  const HeldTokens& tokens_;
  const std::string host_;
  const Incarnation incarnation_;
  const gateway::Bell& bell_;
  shm::FileDescriptor epoll_;
  shm::FileDescriptor wake_;
  const gateway::Bell readers_;  // rings where readers of ours change
  EndWatch demands_;             // the sending thread's
  std::map<std::string, std::uint64_t, std::less<>> ids_;
  std::uint64_t last_id_ = 0;
  // Held by the link's thread while it waits for mutex_; the other one passes through.
  std::mutex gate_;
  std::mutex mutex_;
  std::map<std::uint64_t, std::unique_ptr<Export>> exports_;
  std::set<std::uint64_t> ready_;  // of which something may have to be sent
  std::uint64_t in_turn_ = 0;      // 0: none
  bool has_closed_ = false;        // a tap, since the sending thread has looked
  bool ends_ = false;
  // The sending thread's.
  std::vector<std::uint64_t> turns_;  // who was ready when it looked
  bool has_unsaid_ = false;           // an event of one of them may not have been written
  bool has_taken_ = false;            // an event, since it looked
  EventHeader header_;
  std::array<std::byte, kMaxHeaderBytes> buffer_{};
  DatagramTrains trains_;
  Rush rush_;
  std::thread thread_;
};

}  // namespace arbiter::link
