#include "gateway/dds/peers.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <string_view>
#include <utility>

namespace arbiter::gateway::dds {
namespace {

constexpr std::array kEnds{End::kReader, End::kWriter};
constexpr std::size_t kBatch = 32;
constexpr std::size_t kMaxName = 256;  // of what strangers say
// Of an owner's name, so that a status has room for what the owner does.
constexpr std::size_t kMaxOwner = 80;

std::string bounded(const char* text) {
  return text == nullptr ? std::string() : std::string(text).substr(0, kMaxName);
}

Guid guid_of(const dds_guid_t& guid) {
  Guid result;
  std::copy(std::begin(guid.v), std::end(guid.v), result.begin());
  return result;
}

std::string property(const dds_qos_t& qos, const char* name) {
  char* value = nullptr;
  if (!dds_qget_prop(&qos, name, &value)) return {};
  std::string result = bounded(value);
  dds_free(value);
  return result;
}

// Of a participant that does not say who it is: who made its DDS, and its number.
std::string number_of(const Guid& participant) {
  std::string vendor = "DDS participant";
  if (participant[0] == 0x01 && participant[1] == 0x0f) vendor = "Fast DDS participant";
  if (participant[0] == 0x01 && participant[1] == 0x10) vendor = "Cyclone DDS participant";
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), " %02x%02x%02x%02x.%02x%02x%02x%02x.%02x%02x%02x%02x",
                participant[0], participant[1], participant[2], participant[3], participant[4],
                participant[5], participant[6], participant[7], participant[8], participant[9],
                participant[10], participant[11]);
  return vendor + text.data();
}

// "RIHS", a version, "_", and for version 01 the digits of a SHA-256 (REP 2016).
bool is_type_hash(std::string_view hash) {
  constexpr std::string_view kKnown = "RIHS01_";
  constexpr std::size_t kDigits = 64;
  return hash.size() == kKnown.size() + kDigits && hash.starts_with(kKnown) &&
         hash.find_first_not_of("0123456789abcdef", kKnown.size()) == std::string_view::npos;
}

Listener on_data(const Bell& bell) {
  Listener listener(dds_create_listener(const_cast<Bell*>(&bell)));
  dds_lset_data_available(listener.get(), [](dds_entity_t /*reader*/, void* argument) {
    static_cast<const Bell*>(argument)->ring();
  });
  return listener;
}

}  // namespace

bool has_key(const Guid& guid) {
  const unsigned kind = guid[15] & 0x0fU;
  return kind == 0x02 || kind == 0x07;
}

std::string type_hash_in(const std::string& user_data) {
  constexpr std::string_view kKey = "typehash=";
  std::size_t at = 0;
  while (at < user_data.size()) {
    const std::size_t end = std::min(user_data.find(';', at), user_data.size());
    if (user_data.compare(at, kKey.size(), kKey) == 0) {
      std::string hash = user_data.substr(at + kKey.size(), end - at - kKey.size());
      return is_type_hash(hash) ? hash : std::string();
    }
    at = end + 1;
  }
  return {};
}

Peers::Peers(dds_entity_t participant, const std::set<std::string>& topics, const Bell& bell)
    : participant_(participant), bell_(bell) {
  for (const std::string& topic : topics) topics_.try_emplace(topic);
  note_own(participant);
  participants_ =
      Entity(dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr),
             "the reader of participants");
  for (const End end : kEnds) lookouts_[end] = lookout(end);
}

Entity Peers::lookout(End end) const {
  const Listener listener = on_data(bell_);
  const bool of_readers = end == End::kReader;
  return {dds_create_reader(
              participant_,
              of_readers ? DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION : DDS_BUILTIN_TOPIC_DCPSPUBLICATION,
              nullptr, listener.get()),
          of_readers ? "the reader of readers" : "the reader of writers"};
}

void Peers::note_own(dds_entity_t participant) {
  dds_guid_t own{};
  if (dds_get_guid(participant, &own) == DDS_RETCODE_OK) own_.insert(guid_of(own));
}

void Peers::update() {
  forget_gone_participants();
  for (const End end : kEnds) {
    update(lookouts_[end], end);
    if (has_thinned(end)) look_again(end);
  }
}

// Each look costs as much as there are ends: it needs many that have gone, so that a stranger
// cannot ask for one by a single end that comes and goes.
bool Peers::has_thinned(End end) const {
  const auto is_thin = [](std::size_t count, std::size_t most) { return count <= most / 4 * 3; };
  if (!is_thin(counts_.at(end), kMaxPeers)) return false;
  return std::any_of(topics_.begin(), topics_.end(), [&](const auto& each) {
    const Crowd& crowd = each.second.crowds.at(end);
    return crowd.has_more && is_thin(crowd.count, kMaxOfTopic);
  });
}

// Cyclone tells a reader once of each end, and a new reader of all that are there. What has gone
// before there was the new one, only the old one knows.
void Peers::look_again(End end) {
  const Entity old = std::exchange(lookouts_[end], lookout(end));
  update(old, end);
  for (auto& [name, topic] : topics_) {
    if (std::exchange(topic.crowds[end].has_more, false)) ++topic.revision;
  }
  update(lookouts_[end], end);
}

// Cyclone keeps each one until somebody takes it. Those that are there stay: tell_owner() reads
// them.
void Peers::forget_gone_participants() {
  constexpr std::uint32_t kGone =
      DDS_NOT_ALIVE_DISPOSED_INSTANCE_STATE | DDS_NOT_ALIVE_NO_WRITERS_INSTANCE_STATE;
  for (;;) {
    // Into memory of ours: to give such a loan back ends in "free(): invalid pointer" (0.10.2).
    std::array<dds_builtintopic_participant_t, kBatch> gone{};
    std::array<void*, kBatch> samples{};
    for (std::size_t i = 0; i < kBatch; ++i) samples[i] = &gone[i];
    std::array<dds_sample_info_t, kBatch> infos{};
    const dds_return_t taken =
        dds_take_mask(participants_.get(), samples.data(), infos.data(), kBatch, kBatch,
                      kGone | DDS_ANY_SAMPLE_STATE | DDS_ANY_VIEW_STATE);
    for (const auto& each : gone) dds_delete_qos(each.qos);  // null: it was told nothing of it
    if (taken <= 0) return;
  }
}

void Peers::update(const Entity& reader, End end) {
  for (;;) {
    std::array<void*, kBatch> samples{};
    std::array<dds_sample_info_t, kBatch> infos{};
    const dds_return_t taken = dds_take(reader.get(), samples.data(), infos.data(), kBatch, kBatch);
    if (taken <= 0) return;
    for (std::size_t i = 0; i < static_cast<std::size_t>(taken); ++i) {
      if (infos[i].instance_state != DDS_IST_ALIVE) {
        if (const auto gone = handles_.find(infos[i].instance_handle); gone != handles_.end()) {
          const Place& place = gone->second;
          place.topic->ends.erase(place.guid);
          --place.topic->crowds[place.end].count;
          --counts_[place.end];
          ++place.topic->revision;
          handles_.erase(gone);
        }
      } else if (infos[i].valid_data) {
        add(*static_cast<const dds_builtintopic_endpoint_t*>(samples[i]), end,
            infos[i].instance_handle);
      }
    }
    dds_return_loan(reader.get(), samples.data(), taken);
  }
}

void Peers::add(const dds_builtintopic_endpoint_t& endpoint, End end,
                dds_instance_handle_t handle) {
  if (own_.contains(guid_of(endpoint.participant_key))) return;
  if (endpoint.topic_name == nullptr || endpoint.qos == nullptr) return;
  const auto found = topics_.find(std::string_view(endpoint.topic_name));
  if (found == topics_.end()) return;
  PeersOfTopic& topic = found->second;
  ++topic.revision;
  if (!handles_.contains(handle)) {
    Crowd& crowd = topic.crowds[end];
    if (counts_[end] >= kMaxPeers || crowd.count >= kMaxOfTopic) {
      crowd.has_more = true;
      return;
    }
    ++crowd.count;
    ++counts_[end];
  }
  const Guid guid = guid_of(endpoint.key);
  Peer peer;
  peer.end = end;
  peer.topic = endpoint.topic_name;
  peer.type = bounded(endpoint.type_name);
  peer.keyed = has_key(guid);
  peer.qos = read_announced(*endpoint.qos);
  peer.type_hash = type_hash_in(user_data(*endpoint.qos));
  tell_owner(endpoint, peer);
  topic.ends.insert_or_assign(guid, std::move(peer));
  handles_.insert_or_assign(handle, Place{&topic, guid, end});
}

void Peers::tell_owner(const dds_builtintopic_endpoint_t& endpoint, Peer& peer) const {
  void* sample = nullptr;
  dds_sample_info_t info{};
  const dds_return_t read = dds_read_instance(participants_.get(), &sample, &info, 1, 1,
                                              endpoint.participant_instance_handle);
  if (read == 1 && info.valid_data) {
    const auto& participant = *static_cast<const dds_builtintopic_participant_t*>(sample);
    peer.is_gateway = user_data(*participant.qos) == kOfGateway;
    const std::string name = property(*participant.qos, "__ProcessName");
    const std::string pid = property(*participant.qos, "__Pid");
    const std::string host = property(*participant.qos, "__Hostname");
    if (!name.empty()) {
      peer.owner = name;
      if (!pid.empty()) peer.owner += " (pid " + pid + (host.empty() ? "" : " on " + host) + ")";
      if (peer.owner.size() > kMaxOwner) peer.owner = peer.owner.substr(0, kMaxOwner - 3) + "...";
    }
  }
  if (read > 0) dds_return_loan(participants_.get(), &sample, read);
  if (peer.owner.empty()) peer.owner = number_of(guid_of(endpoint.participant_key));
}

}  // namespace arbiter::gateway::dds
