// How importers tell exporters what they want of each source (link/core/demand.hpp): in the user
// data of their readers. DDS repeats these until every exporter has them, tells them to one that
// comes later, and forgets them with the reader. So a demand is never lost, never outlives its
// importer by more than a lease, and nobody speaks for another's reader.
#pragma once

#include <dds/dds.h>

#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "gateway/core/bridge.hpp"
#include "link/core/cards.hpp"
#include "link/core/demand.hpp"
#include "link/dds/network.hpp"

namespace arbiter::link {

// Says what readers of this link want, on a thread of its own: samples arrive on Cyclone's threads,
// which must not wait for its locks, and the link's own thread may wait for a daemon.
class DemandTeller {
 public:
  // Sets the user data of a reader, and returns what Cyclone does.
  using Set = std::function<dds_return_t(dds_entity_t reader, const ByteString& data)>;

  explicit DemandTeller(Set set = set_user_data);
  DemandTeller(const DemandTeller&) = delete;
  DemandTeller& operator=(const DemandTeller&) = delete;
  ~DemandTeller();

  // Soon; the last word of several, and again until it is said. A reader that is gone by then is
  // passed over. Any thread.
  // False: it will not be said, because memory is short.
  [[nodiscard]] bool tell(dds_entity_t reader, const DemandCard& card) noexcept;

 private:
  static dds_return_t set_user_data(dds_entity_t reader, const ByteString& data);
  void run();
  // False: it has to be said again.
  [[nodiscard]] bool say(dds_entity_t reader, const DemandCard& card) const noexcept;

  const Set set_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<dds_entity_t, DemandCard> untold_;
  bool ends_ = false;
  std::thread thread_;
};

// Rings when a reader, or a writer, on the network has come, or says something else in its user
// data.
//
// Thread safety: one thread.
class EndWatch {
 public:
  enum class Ends : std::uint8_t { kReaders, kWriters };

  // `bell` outlives this. Throws DdsError.
  EndWatch(const Network& network, Ends ends, const gateway::Bell& bell);

  // The topics whose ends have since, in byte order.
  [[nodiscard]] std::vector<std::string> changed();

 private:
  Entity ends_;
};

// What the importers that a writer has want all together: the most of all. Who says nothing, or
// what is no demand, wants all samples.
[[nodiscard]] Demand demand_of_readers(dds_entity_t writer);

}  // namespace arbiter::link
