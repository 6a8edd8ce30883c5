// Who else reads and writes our topics in a domain, as Cyclone has discovered it.
//
// Thread safety: one thread, the gateway's loop. The bell rings on Cyclone's threads.
#pragma once

#include <dds/dds.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include "gateway/core/bridge.hpp"
#include "gateway/dds/cyclone_qos.hpp"
#include "gateway/dds/entity.hpp"

namespace arbiter::gateway::dds {

// A reader or writer of somebody else's. What it says of itself is a stranger's: it may be
// anything.
struct Peer {
  End end = End::kReader;
  std::string topic;
  std::string type;
  // Whether its type has a key. An end with and one without never match, and Cyclone says nothing.
  bool keyed = false;
  AnnouncedQos qos;
  std::string type_hash;    // "RIHS01_…", as ROS 2 has it since Iron
  std::string owner;        // "nav (pid 12)", or a participant's number
  bool is_gateway = false;  // of Arbiter, as it says
};

// By GUID: in an order that does not change.
using Guid = std::array<std::uint8_t, 16>;
using PeerMap = std::map<Guid, Peer>;

// Readers or writers: how many are looked at, and whether there were more.
struct Crowd {
  std::size_t count = 0;
  bool has_more = false;
};

// All that is known of one topic. Strangers may be any number: what does not fit is not looked at
// until others have gone.
struct PeersOfTopic {
  PeerMap ends;
  std::map<End, Crowd> crowds{{End::kReader, {}}, {End::kWriter, {}}};
  std::uint64_t revision = 0;  // another one: something has changed

  [[nodiscard]] bool has_more() const {
    return std::any_of(crowds.begin(), crowds.end(),
                       [](const auto& each) { return each.second.has_more; });
  }
};

class Peers {
 public:
  // Looks for those of `topics` alone: others are none of our business, however many there are.
  // `bell` rings where there is something to take in, and outlives this.
  Peers(dds_entity_t participant, const std::set<std::string>& topics, const Bell& bell);
  Peers(const Peers&) = delete;
  Peers& operator=(const Peers&) = delete;
  ~Peers() = default;

  // Readers, and as many writers: who reads must not hide a writer that goes past Arbiter.
  static constexpr std::size_t kMaxPeers = 4096;
  static constexpr std::size_t kMaxOfTopic = 512;

  // A further participant of ours. Before it has ends.
  void note_own(dds_entity_t participant);
  // Takes in what has come. Does not wait. Throws DdsError.
  void update();
  // Of one of `topics`.
  [[nodiscard]] const PeersOfTopic& of(const std::string& topic) const { return topics_.at(topic); }

 private:
  struct Place {
    PeersOfTopic* topic;
    Guid guid;
    End end;
  };

  [[nodiscard]] Entity lookout(End end) const;
  void update(const Entity& reader, End end);
  [[nodiscard]] bool has_thinned(End end) const;
  void look_again(End end);
  void forget_gone_participants();
  void add(const dds_builtintopic_endpoint_t& endpoint, End end, dds_instance_handle_t handle);
  void tell_owner(const dds_builtintopic_endpoint_t& endpoint, Peer& peer) const;

  dds_entity_t participant_;
  const Bell& bell_;
  std::map<std::string, PeersOfTopic, std::less<>> topics_;
  std::set<Guid> own_;  // our participants, those that have left, too
  std::map<dds_instance_handle_t, Place> handles_;
  std::map<End, std::size_t> counts_{{End::kReader, 0}, {End::kWriter, 0}};  // of all topics
  Entity participants_;
  std::map<End, Entity> lookouts_;  // what Cyclone tells of readers, and of writers
};

// The kind of an end by the last byte of its GUID (RTPS 2.5, table 9.1).
[[nodiscard]] bool has_key(const Guid& guid);
// "typehash=RIHS01_…;" in what ROS 2 writes into the user data; empty: there is none that a node of
// ROS 2 could read.
[[nodiscard]] std::string type_hash_in(const std::string& user_data);
// What each participant of a gateway says in its user data.
inline constexpr std::string_view kOfGateway = "gateway=arbiter;";

}  // namespace arbiter::gateway::dds
