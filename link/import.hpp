// One source of another host that the model here wants: its events become arrivals at an output
// port of this link, under the source's name.
//
// Thread safety: look() and open() on the link's thread; take() on Cyclone's threads, one at a
// time; yield() on the node's. mutex_ guards what they share. A port is opened and closed without
// it.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <arbiter/node.hpp>
#include <arbiter/output_port.hpp>

#include "link/core/demand.hpp"
#include "link/core/event_header.hpp"
#include "link/core/import_choice.hpp"
#include "link/core/offers.hpp"
#include "link/core/patience.hpp"
#include "link/core/sent_tokens.hpp"
#include "link/core/stream.hpp"
#include "link/dds/demands.hpp"
#include "link/dds/event_topic.hpp"
#include "shm/activity.hpp"
#include "wire/hosts.hpp"

namespace arbiter::link {

// Nanoseconds of a clock that goes on while the machine sleeps.
[[nodiscard]] shm::Nanoseconds time_with_sleep() noexcept;

class Import : private gateway::dds::SampleTaker {
 public:
  // `me`: of this link, in whose name tokens are sent. `bell` rings where look() has something to
  // do. `stream`: what an earlier import of the source has left, or nothing. Keeps references.
  // Throws DdsError.
  Import(Node& node, const Network& network, const SentTokens& tokens, std::string source,
         Incarnation me, const gateway::Bell& bell, DemandTeller& demands, SourceUse use,
         const Stream& stream = {});
  Import(const Import&) = delete;
  Import& operator=(const Import&) = delete;
  ~Import() override;

  // How old a sample may be when it arrives.
  void set_max_age(shm::Nanoseconds age) noexcept {
    max_age_.store(age, std::memory_order_relaxed);
  }
  // Who speaks now, and whether the port is to be open: closes it if it is not. `use`: by the model
  // in force.
  void look(bool is_open_here, SourceUse use, const OtherLinks& others);
  // After look(): opens the port if it is to be open and is not.
  void open(bool has_daemon, const Patience& patience);
  // Any thread: a component of this host asks for the name. Closes the port at once.
  void yield();
  // The link's thread: nothing arrives any more. Waits for nobody, as the destructor may.
  void close();
  // The same; the port is opened again, but not at once.
  void begin_again();
  // The last call: nothing is heard any more. Returns what has come, so that it does not come again
  // if the source is imported again. Takes longer than close().
  [[nodiscard]] Stream end();

  // For the hosts document, but for what this host has open itself.
  [[nodiscard]] wire::ImportStatus status() const;

 private:
  struct Counts {
    std::uint64_t late = 0;
    std::uint64_t unreadable = 0;  // no event, or a sample that its type cannot have
    std::uint64_t too_soon = 0;    // samples, sent or not, that came while the port was not open
    std::uint64_t no_memory = 0;
    std::uint64_t without_sample = 0;  // arrivals whose samples could not be sent
    std::uint64_t withheld = 0;        // samples that stayed at home
    std::uint64_t unbelieved = 0;      // of them, headers alone, long after samples were asked for
  };

  // publish() throws for another port's loan, and this one is its own; what is remembered here has
  // its memory from the beginning.
  void take(const gateway::dds::Payload& payload,  // NOLINT(bugprone-exception-escape)
            const gateway::dds::SampleWriter& writer) noexcept override;
  // Whom to obey from now on; null: nobody.
  void obey(const Offer* speaker);
  // Under the lock, by header_.
  void arrive(const gateway::dds::Payload& payload, std::size_t before);
  // Of the event in header_.
  [[nodiscard]] Origin origin() const noexcept;
  // Nothing: it was no arrival, and is counted.
  std::optional<Outcome> publish(const gateway::dds::Payload& payload, std::size_t before,
                                 Time deadline);
  // The sample, behind header_, in the port's memory; nothing: there is none, and it is counted.
  std::optional<Loan<void>> sample_in(const gateway::dds::Payload& payload, std::size_t before);
  // The sample of the last arrival, which was withheld.
  void complete(const gateway::dds::Payload& payload, std::size_t before);
  // How long an event with header_'s tokens is in time; below 0: it is late.
  [[nodiscard]] shm::Nanoseconds time_left() const;
  // Has exporters told what is wanted, if that has changed.
  void say_demand();
  // Of one that finds no place the state is not known before its next event.
  void remember(std::uint64_t writer, const StreamEvent& event) noexcept;

  void listen_to_speaker(const OtherLinks& others);
  void forget(const std::vector<Offer>& offers);
  void open_port(const OfferCard& card);
  // Whether it has yielded, and this host's status may not say yet to whom.
  [[nodiscard]] bool has_just_yielded();
  [[nodiscard]] bool is_open() const;
  void say_who_speaks();
  void say_shared_name();
  void say_once(const std::string& text);
  void describe();
  // "host head, 3 lost, 2 late".
  [[nodiscard]] std::string text() const;

  Node& node_;
  const SentTokens& tokens_;
  const std::string source_;
  const Incarnation me_;
  DemandTeller& demands_;
  std::atomic<shm::Nanoseconds> max_age_{shm::kDefaultTimeout};

  // The link's thread.
  Offers offers_;
  std::string last_host_;  // that it was taken from; empty: none yet
  std::string said_;
  std::string described_;
  std::string hosts_said_;
  std::string shared_name_said_;
  shm::Nanoseconds open_again_ = 0;
  shm::Nanoseconds describe_again_ = 0;

  mutable std::mutex mutex_;
  // Kept by describe(), too, while that waits for the node.
  std::shared_ptr<OutputPort<void>> port_;
  shm::Nanoseconds spoken_here_until_ = 0;  // it has yielded
  std::uint32_t revision_ = 0;              // of the port's type
  Incarnation obeyed_ = 0;                  // the speaker's; 0: nobody
  std::uint64_t writer_ = 0;                // likewise its key: nobody else speaks in its name
  Stream stream_;
  // The last event of each exporter that is not obeyed: the first that comes is the present state,
  // and comes before the exporter can be chosen.
  struct Unheard {
    std::uint64_t writer = 0;
    Incarnation exporter = 0;
    StreamEvent last;
  };
  static constexpr std::size_t kMaxUnheard = 64;
  std::vector<Unheard> unheard_;
  Counts counts_;
  EventHeader header_;  // of take()
  ImportDemand demand_;
  Demand said_demand_;
  dds_entity_t demanding_ = 0;  // the reader that says so; 0: there is none yet
  bool awaits_sample_ = false;  // the port's last arrival was a signal for one that was withheld

  std::optional<EventReader> reader_;
};

}  // namespace arbiter::link
