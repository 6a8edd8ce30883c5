// The two ends of a source's topic: one writer on each host that has the source open, one reader on
// each host whose model wants it. Offers and demands travel as DDS makes ends known to each other;
// a writer's user data say what it offers (link/core/cards.hpp).
//
// Both are reliable, keep the last event and give it to a reader that comes later: so whatever is
// lost, the last event gets through, and it tells the source's state (link/core/stream.hpp). If
// they kept more, new samples would wait for old ones. A reader's user data say which samples it
// wants (demands.hpp).
#pragma once

#include <dds/dds.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <arbiter/bytes.hpp>

#include "gateway/core/bridge.hpp"
#include "gateway/dds/reader_cache.hpp"
#include "link/core/cards.hpp"
#include "link/core/demand.hpp"
#include "link/core/offers.hpp"
#include "link/dds/network.hpp"

namespace arbiter::link {

// Thread safety: one thread, or a lock of the owner's; is_wanted() any thread.
class EventWriter {
 public:
  // `bell` rings when readers come or go, and outlives this. Throws DdsError.
  EventWriter(const Network& network, const OfferCard& card, const gateway::Bell& bell);

  [[nodiscard]] const std::string& topic() const { return name_; }
  // Whether any host reads it now.
  [[nodiscard]] bool is_wanted() const;
  // What all its readers want together (demands.hpp), and how often readers have come or gone.
  [[nodiscard]] Demand demand() const;
  [[nodiscard]] std::uint32_t changes_of_readers() const;
  // Another card for the same source: its type is now known, or has changed.
  void set_card(const OfferCard& card);
  // Waits for no reader. False: it was not written, because memory is short.
  [[nodiscard]] bool write(Bytes header, Bytes sample) noexcept;

 private:
  const std::string name_;  // of the topic
  const ddsi_sertype* type_ = nullptr;
  Entity topic_;
  Entity writer_;
};

class EventReader {
 public:
  // `taker` is called on Cyclone's threads, one at a time. `bell` rings when offers() change.
  // Both outlive this. Throws DdsError.
  EventReader(const Network& network, const std::string& source, gateway::dds::SampleTaker& taker,
              const gateway::Bell& bell, const DemandCard& demand);

  // By which DemandTeller knows it.
  [[nodiscard]] dds_entity_t handle() const { return reader_.get(); }
  // Who offers the source now, of each participant the newest. Malformed cards are passed over. Of
  // very many some are looked at each time, in turn, but `current` always, if it is there.
  [[nodiscard]] std::vector<Offer> offers(std::uint64_t current);

 private:
  void look_at(std::uint64_t writer);

  gateway::dds::ReaderCache cache_;
  Entity topic_;
  Entity reader_;
  std::map<std::uint64_t, Offer> offers_;  // by their keys; of writers that have been looked at
  std::uint64_t looked_at_ = 0;            // the last one
};

// All writers that a reader has, however many.
[[nodiscard]] std::vector<std::uint64_t> writers_of(dds_entity_t reader);

// The header of encapsulation that stands before everything that links send.
[[nodiscard]] Bytes encapsulation() noexcept;

}  // namespace arbiter::link
