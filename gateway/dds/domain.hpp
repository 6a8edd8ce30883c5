// A domain of DDS, and our participants in it: one that writes and looks at who is there, and one
// that reads, so that it can leave and come back without those who are written to noticing.
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

// Cyclone's configuration for it: what `file` says, the mapping's own if there is one, and what the
// mapping says; where it says nothing, what CYCLONEDDS_URI says. Not both: Cyclone adds up
// interfaces and peers.
[[nodiscard]] std::string configuration_of(const Gateway& gateway, const std::string& file);

// Whether Cyclone may have to look up a name for it, which may take long.
[[nodiscard]] bool may_look_up_names(const Gateway& gateway);

// As text of that configuration.
[[nodiscard]] std::string escaped(const std::string& text);

class Domain {
 public:
  // Throws DdsError: there is no such network interface now, for example.
  Domain(const Gateway& gateway, const std::set<std::string>& topics, const Bell& bell);

  // The one of our readers is made when it is asked for first. Throws DdsError.
  [[nodiscard]] dds_entity_t participant(End end);
  // The participant that reads leaves. No reader is open.
  void leave_readers() noexcept { readers_ = Entity(); }
  [[nodiscard]] Peers& peers() { return peers_; }
  [[nodiscard]] dds_domainid_t id() const { return id_; }

 private:
  const dds_domainid_t id_;
  Entity domain_;
  Entity participant_;
  Entity readers_;
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
  // Those of whom it says that it knows no address, as they were given.
  [[nodiscard]] std::vector<std::string> unknown_peers() const;
  // The calls did not fail: what it has said is said as a warning.
  void tell() const;

 private:
  std::vector<std::string> lines_;
};

}  // namespace arbiter::gateway::dds
