#include "gateway/dds/end_point.hpp"

#include <dds/ddsi/ddsi_sertype.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "gateway/core/say.hpp"
#include "gateway/dds/opaque_type.hpp"
#include "gateway/dds/quota.hpp"
#include "gateway/mapping/encapsulation.hpp"
#include "shm/clock.hpp"

namespace arbiter::gateway::dds {
namespace {

constexpr std::size_t kMaxListed = 4;  // parts of a description

// Of an end of ROS 2, whose type hash may not be known yet. Nodes since Iron warn of an end that
// has no user data at all, or a hash that they cannot read; but not of data without one.
void set_user_data(dds_qos_t* qos, const std::string& type_hash) {
  const std::string data = type_hash.empty() ? "gateway=arbiter;" : "typehash=" + type_hash + ";";
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
  // Whoever is expected may be in another, which nobody sees from here.
  account_.set_place(" in domain " + std::to_string(domain.id()));
  open();
}

void EndPoint::open() {
  const dds_entity_t participant = domain_->participant(which_);
  ddsi_sertype* type = make_opaque_type(topic_.type, keyed_);
  const dds_entity_t topic =
      dds_create_topic_sertype(participant, topic_.name.c_str(), &type, nullptr, nullptr, nullptr);
  if (topic < 0) ddsi_sertype_unref(type);
  topic_entity_ = Entity(topic, "topic " + topic_.name);
  topic_.qos.durability = durability();
  const CycloneQos qos = cyclone_qos(topic_.qos, which_);
  if (topic_.is_ros || !type_hash_.empty()) set_user_data(qos.get(), type_hash_);
  Entity made = make(participant, topic, type, qos.get());
  seen_.reset();
  const std::lock_guard lock(in_use_);
  end_ = std::move(made);
  begin();
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

std::string EndPoint::wrong_size(std::size_t bytes) const {
  return "the last bad sample has " + std::to_string(bytes) +
         (bytes == 1 ? " byte; " : " bytes; ") + entry_.type->name + " has " +
         std::to_string(padded(kEncapsulationBytes + topic_.size.value_or(0)));
}

void EndPoint::look_at(const PeersOfTopic& peers) {
  if (is_open()) choose_durability();
  // Strangers may be many, and come and go: each is looked at when something has changed.
  if (seen_ != peers.revision || why_less_durable_ != why_less_durable() ||
      was_served_ != is_served()) {
    choose_kind(peers.ends);
    if (!is_open()) return;
    adopt_type_hash(peers.ends);
    find_obstacles(peers);
    seen_ = peers.revision;
  }
  const std::uint32_t count = matched();
  account_.set_peers(count);
  tell_obstacles(count);
  warn();
  catch_up();
}

// Where the mapping does not say whether the type has a key, who is there says it: without this,
// they would never match, and nothing in DDS says why. As long as no more peers have the other
// kind, this end keeps its own. Who is in another partition is not meant. The types of ROS 2 have
// no keys: one stray end that has one must not keep the gateway from all others.
void EndPoint::choose_kind(const PeerMap& peers) {
  if (topic_.qos.keyed || topic_.is_ros) return;
  std::size_t like_us = 0;
  std::size_t others = 0;
  for (const auto& [guid, peer] : peers) {
    if (peer.end == which_ || peer.type != topic_.type) continue;
    if (!may_meet(topic_.qos, peer.qos)) continue;
    ++(peer.keyed == keyed_ ? like_us : others);
  }
  if (others <= like_us) return;
  keyed_ = !keyed_;
  close();
  open();
}

void EndPoint::choose_durability() {
  if (durability() == topic_.qos.durability) return;
  close();
  open();
}

// A node of ROS 2 (Iron and later) that finds an end without a type hash warns of it. Whoever uses
// the topic knows the hash.
void EndPoint::adopt_type_hash(const PeerMap& peers) {
  if (!type_hash_.empty()) return;
  for (const auto& [guid, peer] : peers) {
    if (peer.type != topic_.type || peer.type_hash.empty()) continue;
    type_hash_ = peer.type_hash;
    const CycloneQos qos(dds_create_qos());
    set_user_data(qos.get(), type_hash_);
    const dds_return_t set = dds_set_qos(end_.get(), qos.get());
    if (set < 0) {
      say(Level::kWarning,
          account_.outside() + ": ROS 2's type hash cannot be set: " + dds_strretcode(-set));
    }
    return;
  }
}

void EndPoint::find_obstacles(const PeersOfTopic& peers) {
  obstacles_.clear();
  // Those that go past Arbiter come first: a status has room for a few sentences alone.
  std::vector<std::string> others;
  Warnings::Sentences warnings;
  was_served_ = is_served();
  for (const auto& [guid, peer] : peers.ends) {
    const bool meet = may_meet(topic_.qos, peer.qos);
    if (peer.end != which_) {
      const std::vector<std::string> reasons = mismatches({which_, topic_, keyed_}, peer);
      if (reasons.empty()) continue;
      others.push_back("the " + std::string(which_ == End::kReader ? "publisher" : "subscriber") +
                       " of " + peer.owner + " does not match: " + joined(reasons));
      // Whoever is in another partition is probably meant to be.
      if (meet) warnings.emplace_back(guid, others.back());
    } else if (which_ == End::kWriter && meet && was_served_) {
      obstacles_.push_back(
          peer.is_gateway
              ? "another gateway has this topic, " + peer.owner +
                    ": what it sends reaches the subscribers past this one"
              : peer.owner +
                    " publishes there, too: what it sends reaches the subscribers past Arbiter");
      warnings.emplace_back(guid, obstacles_.back());
    }
  }
  why_less_durable_ = why_less_durable();
  is_trouble_ = !warnings.empty() || !why_less_durable_.empty();
  warnings_.set(std::move(warnings), peers.ends);
  if (!why_less_durable_.empty()) {
    obstacles_.push_back("samples published before are not taken, because " +
                         std::string(why_less_durable_));
  }
  if (peers.has_more()) obstacles_.emplace_back("there are more ends than the gateway looks at");
  has_mismatches_ = !others.empty();
  obstacles_.insert(obstacles_.end(), std::make_move_iterator(others.begin()),
                    std::make_move_iterator(others.end()));
}

void EndPoint::tell_obstacles(std::uint32_t count) {
  if (obstacles_.empty()) {
    account_.set_obstacle("");
    return;
  }
  // An obstacle takes the place of the number of peers. Who does not match says that none does.
  std::string text;
  if (count > 0 || !has_mismatches_) {
    text = (count == 0 ? "no" : std::to_string(count)) +
           (which_ == End::kReader ? " publisher" : " subscriber") + (count > 1 ? "s" : "") +
           " matched; ";
  }
  account_.set_obstacle(text + joined(obstacles_), is_trouble_);
}

void EndPoint::warn() {
  // Ends that come and go make warnings: their number must not fill a disk.
  static Quota& quota = *new Quota(20, 10'000'000'000);
  for (const std::string& sentence : warnings_.take(quota, shm::monotonic_now())) {
    say(Level::kWarning, account_.outside() + ": " + sentence);
  }
}

}  // namespace arbiter::gateway::dds
