// One source of another host that the model here wants: its events become arrivals at an output
// port of this link, under the source's name.
//
// Thread safety: look() on the link's thread; take() on Cyclone's threads, one at a time. mutex_
// guards what both use. A port is opened and closed without it.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <arbiter/node.hpp>
#include <arbiter/output_port.hpp>

#include "link/core/event_header.hpp"
#include "link/core/import_choice.hpp"
#include "link/core/patience.hpp"
#include "link/core/sent_tokens.hpp"
#include "link/core/speaker.hpp"
#include "link/core/stream.hpp"
#include "link/dds/event_topic.hpp"
#include "shm/activity.hpp"

namespace arbiter::link {

// Nanoseconds of a clock that goes on while the machine sleeps.
[[nodiscard]] shm::Nanoseconds time_with_sleep() noexcept;

class Import : private gateway::dds::SampleTaker {
 public:
  // `me`: of this link, in whose name tokens are sent. `bell` rings where look() has something to
  // do. Keeps references. Throws DdsError.
  Import(Node& node, const Network& network, const SentTokens& tokens, std::string source,
         Incarnation me, const gateway::Bell& bell);
  Import(const Import&) = delete;
  Import& operator=(const Import&) = delete;
  ~Import() override;

  // How old a sample may be when it arrives.
  void set_max_age(shm::Nanoseconds age) noexcept {
    max_age_.store(age, std::memory_order_relaxed);
  }
  // Who speaks now, and whether the port is to be open: closes it if it is not.
  void look(bool is_open_here);
  // After look(): opens the port if it is to be open and is not.
  void open(bool has_daemon, const Patience& patience);

 private:
  struct Counts {
    std::uint64_t late = 0;
    std::uint64_t unreadable = 0;  // no event, or a sample that its type cannot have
    std::uint64_t too_soon = 0;    // samples that came while the port was not open
    std::uint64_t no_memory = 0;
  };

  // publish() throws for another port's loan, and this one is its own; what is remembered here has
  // its memory from the beginning.
  void take(const gateway::dds::Payload& payload,  // NOLINT(bugprone-exception-escape)
            dds_instance_handle_t writer) noexcept override;
  // Whom to obey from now on; null: nobody.
  void obey(const Offerer* speaker);
  // Under the lock, by header_.
  void arrive(const gateway::dds::Payload& payload, std::size_t before);
  void publish(const gateway::dds::Payload& payload, std::size_t before, Time deadline);
  // Of one that finds no place the state is not known before its next event.
  void remember(std::uint64_t writer, const StreamEvent& event) noexcept;

  void listen_to_speaker();
  void forget(const std::vector<EventReader::Offer>& offers);
  void open_port(const OfferCard& card);
  void close();
  void say_who_speaks();
  void find_shared_name();
  void say_once(const std::string& text);
  void describe();
  // "host head, 3 lost, 2 late".
  [[nodiscard]] std::string text() const;

  Node& node_;
  const SentTokens& tokens_;
  const std::string source_;
  const Incarnation me_;
  std::atomic<shm::Nanoseconds> max_age_{shm::kDefaultTimeout};

  // The link's thread.
  Speaker speaker_;
  struct Offered {
    OfferCard card;
    shm::Nanoseconds since = 0;
  };
  std::map<std::uint64_t, Offered> offers_;
  std::string said_;
  std::string described_;
  std::string hosts_said_;
  std::string shared_name_;  // of several machines; empty: there is none
  std::string shared_name_said_;
  shm::Nanoseconds open_again_ = 0;

  mutable std::mutex mutex_;
  std::optional<OutputPort<void>> port_;
  std::uint32_t revision_ = 0;  // of the port's type
  Incarnation obeyed_ = 0;      // the speaker's; 0: nobody
  std::uint64_t writer_ = 0;    // likewise its key: nobody else speaks in its name
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

  std::optional<EventReader> reader_;
};

}  // namespace arbiter::link
