// What is warned of at one end: each sentence about a peer once, and all ends together no more in a
// time than a log can bear. What cannot be said yet is said later, if it is still true.
//
// Thread safety: one thread.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/dds/peers.hpp"
#include "gateway/dds/quota.hpp"
#include "shm/activity.hpp"

namespace arbiter::gateway::dds {

class Warnings {
 public:
  using Sentences = std::vector<std::pair<Guid, std::string>>;

  // What is true now, in the place of what was. Of a peer that has gone, nothing is known any more.
  void set(Sentences now, const PeerMap& peers);
  // What is to be said now.
  [[nodiscard]] std::vector<std::string> take(Quota& quota, shm::Nanoseconds now);

 private:
  std::map<Guid, std::set<std::string>> said_;
  Sentences to_say_;
};

}  // namespace arbiter::gateway::dds
