// A domain of DDS, and our participant in it.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "gateway/dds/entity.hpp"
#include "gateway/dds/peers.hpp"
#include "gateway/mapping/mapping.hpp"

namespace arbiter::gateway::dds {

// The domain that the mapping says, or ROS_DOMAIN_ID, or 0. Throws DdsError where that variable has
// no number.
[[nodiscard]] dds_domainid_t domain_of(const Gateway& gateway);

// Cyclone's configuration for it: what the mapping's own file says, and what the mapping says;
// where it says nothing, what CYCLONEDDS_URI says. Not both: Cyclone adds up interfaces and peers.
[[nodiscard]] std::string configuration_of(const Gateway& gateway);

class Domain {
 public:
  // Throws DdsError: there is no such network interface now, for example.
  Domain(const Gateway& gateway, const std::set<std::string>& topics, const Bell& bell);

  [[nodiscard]] dds_entity_t participant() const { return participant_.get(); }
  [[nodiscard]] Peers& peers() { return peers_; }

 private:
  Entity domain_;
  Entity participant_;
  Peers peers_;
};

// Lets Cyclone's messages go to say() (gateway/core/say.hpp), at most so many a second.
void hear_cyclone();

// Keeps what Cyclone says on this thread while it lives, in place of that: a call that fails says
// why, while its result is "Error".
class CycloneWords {
 public:
  CycloneWords();
  CycloneWords(const CycloneWords&) = delete;
  CycloneWords& operator=(const CycloneWords&) = delete;
  ~CycloneWords();

  // Empty: it has said nothing.
  [[nodiscard]] std::string last() const { return lines_.empty() ? "" : lines_.back(); }
  // The calls did not fail: what it has said is said as a warning.
  void tell() const;

 private:
  std::vector<std::string> lines_;
};

}  // namespace arbiter::gateway::dds
