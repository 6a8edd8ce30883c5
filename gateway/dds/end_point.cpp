#include "gateway/dds/end_point.hpp"

#include <dds/ddsi/ddsi_sertype.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "gateway/core/say.hpp"
#include "gateway/dds/opaque_type.hpp"

namespace arbiter::gateway::dds {
namespace {

constexpr std::size_t kMaxListed = 4;  // parts of a description

void set_type_hash(dds_qos_t* qos, const std::string& hash) {
  const std::string data = "typehash=" + hash + ";";
  dds_qset_userdata(qos, data.data(), data.size());
}

std::string joined(const std::vector<std::string>& parts) {
  std::string result;
  const std::size_t listed = std::min(parts.size(), kMaxListed);
  for (std::size_t i = 0; i < listed; ++i) result += (i == 0 ? "" : "; ") + parts[i];
  if (parts.size() > listed) {
    result += "; and " + std::to_string(parts.size() - listed) + " more";
  }
  return result;
}

}  // namespace

EndPoint::EndPoint(End end, const Entry& entry, Account& account)
    : which_(end),
      entry_(entry),
      topic_(*entry.dds),
      account_(account),
      keyed_(topic_.qos.keyed.value_or(false)) {}

void EndPoint::open(Domain& domain) {
  domain_ = &domain;
  open();
}

void EndPoint::open() {
  ddsi_sertype* type = make_opaque_type(topic_.type, keyed_);
  const dds_entity_t topic = dds_create_topic_sertype(domain_->participant(), topic_.name.c_str(),
                                                      &type, nullptr, nullptr, nullptr);
  if (topic < 0) ddsi_sertype_unref(type);
  topic_entity_ = Entity(topic, "topic " + topic_.name);
  const CycloneQos qos = cyclone_qos(topic_.qos, which_);
  if (!type_hash_.empty()) set_type_hash(qos.get(), type_hash_);
  Entity made = make(domain_->participant(), topic, type, qos.get());
  const std::lock_guard lock(in_use_);
  end_ = std::move(made);
}

void EndPoint::close() noexcept {
  Entity end;  // goes outside of the lock, which a thread of Cyclone's may want
  {
    const std::lock_guard lock(in_use_);
    end = std::move(end_);
  }
  end = Entity();
  topic_entity_ = Entity();
}

void EndPoint::look_at(const PeerMap& peers) {
  choose_kind(peers);
  if (!is_open()) return;
  adopt_type_hash(peers);
  account_.set_peers(matched());
  say_who_does_not_match(peers);
}

// Where the mapping does not say whether the type has a key, who is there says it: without this,
// they would never match, and nothing in DDS says why. As long as one peer has the kind that this
// end has, it stays.
void EndPoint::choose_kind(const PeerMap& peers) {
  if (topic_.qos.keyed) return;
  bool like_us = false;
  bool other = false;
  for (const auto& [guid, peer] : peers) {
    if (peer.end == which_ || peer.topic != topic_.name || peer.type != topic_.type) continue;
    (peer.keyed == keyed_ ? like_us : other) = true;
  }
  if (like_us || !other) return;
  keyed_ = !keyed_;
  close();
  open();
}

// A node of ROS 2 (Iron and later) that finds an end without a type hash warns of it. Whoever uses
// the topic knows the hash.
void EndPoint::adopt_type_hash(const PeerMap& peers) {
  if (!type_hash_.empty()) return;
  for (const auto& [guid, peer] : peers) {
    if (peer.topic != topic_.name || peer.type != topic_.type || peer.type_hash.empty()) continue;
    type_hash_ = peer.type_hash;
    const CycloneQos qos(dds_create_qos());
    set_type_hash(qos.get(), type_hash_);
    const dds_return_t set = dds_set_qos(end_.get(), qos.get());
    if (set < 0) {
      say(Level::kWarning,
          account_.outside() + ": ROS 2's type hash cannot be set: " + dds_strretcode(-set));
    }
    return;
  }
}

void EndPoint::say_who_does_not_match(const PeerMap& peers) {
  std::vector<std::string> obstacles;
  for (const auto& [guid, peer] : peers) {
    if (peer.topic != topic_.name) continue;
    if (peer.end != which_) {
      const std::vector<std::string> reasons = mismatches({which_, topic_, keyed_}, peer);
      if (reasons.empty()) continue;
      const std::string sentence =
          "the " + std::string(which_ == End::kReader ? "publisher" : "subscriber") + " of " +
          peer.owner + " does not match: " + joined(reasons);
      obstacles.push_back(sentence);
      // Whoever is in another partition is probably meant to be.
      if (share_partition(topic_.qos.partitions, peer.qos.partitions)) warn(guid, sentence);
    } else if (which_ == End::kWriter &&
               share_partition(topic_.qos.partitions, peer.qos.partitions)) {
      const std::string sentence = peer.owner +
                                   " publishes there, too: what it sends reaches the subscribers "
                                   "past Arbiter";
      obstacles.push_back(sentence);
      warn(guid, sentence);
    }
  }
  // An obstacle takes the place of the number of peers.
  const std::uint32_t others = obstacles.empty() ? 0 : matched();
  if (others > 0) {
    obstacles.insert(obstacles.begin(), std::to_string(others) + " " +
                                            (which_ == End::kReader ? "publisher" : "subscriber") +
                                            (others == 1 ? "" : "s") + " matched");
  }
  account_.set_obstacle(joined(obstacles));
  std::erase_if(warned_, [&](const auto& one) { return !peers.contains(one.first); });
}

void EndPoint::warn(const Guid& guid, const std::string& sentence) {
  if (warned_[guid].insert(sentence).second) {
    say(Level::kWarning, account_.outside() + ": " + sentence);
  }
}

}  // namespace arbiter::gateway::dds
