#include "gateway/dds/mismatch.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "gateway/mapping/partitions.hpp"
#include "gateway/mapping/ros_names.hpp"

namespace arbiter::gateway::dds {
namespace {

template <std::size_t N>
const char* word(const std::array<const char*, N>& words, int kind) {
  return kind >= 0 && static_cast<std::size_t>(kind) < N ? words[static_cast<std::size_t>(kind)]
                                                         : "something unknown";
}

// Bytes of the partitions of one peer, who may have made them to be slow, as may hundreds like it.
constexpr std::size_t kMostComparedOfPeer = 100'000;

constexpr std::array kReliabilities = {"best_effort", "reliable"};
constexpr std::array kDurabilities = {"volatile", "transient_local", "transient", "persistent"};
constexpr std::array kOwnerships = {"shared", "exclusive"};
constexpr std::array kLivelinesses = {"automatic", "manual_by_participant", "manual_by_topic"};
constexpr std::array kOrders = {"by reception", "by source time"};
constexpr std::array kRepresentations = {"XCDR1", "XML", "XCDR2"};

std::string duration(shm::Nanoseconds nanoseconds) {
  if (nanoseconds == shm::kForever) return "none";
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%g ms", static_cast<double>(nanoseconds) / 1e6);
  return text.data();
}

std::string list(const std::vector<std::string>& names) {
  if (names.empty()) return "the default one";
  std::string result;
  for (const std::string& name : names) {
    result += (result.empty() ? "\"" : ", \"") + name + "\"";
  }
  return result;
}

std::string list(const std::vector<int>& representations) {
  std::string result;
  for (const int kind : representations) {
    result += (result.empty() ? "" : " or ") + std::string(word(kRepresentations, kind));
  }
  return result;
}

// Collects, for one pair of ends, what the writer offers and the reader asks for.
class Comparison {
 public:
  Comparison(const OurEnd& ours, const Peer& peer)
      : reads_(ours.end == End::kReader),
        mine_(announced_by(ours.topic.qos, ours.end)),
        reader_(reads_ ? mine_ : peer.qos),
        writer_(reads_ ? peer.qos : mine_) {}

  // This entry is the reader.
  [[nodiscard]] bool reads() const { return reads_; }
  [[nodiscard]] const AnnouncedQos& reader() const { return reader_; }
  [[nodiscard]] const AnnouncedQos& writer() const { return writer_; }

  // `remedy`: what to write in the mapping, given what the other end has; empty: nothing helps.
  void add(const std::string& policy, const std::string& offered, const std::string& asked,
           const std::string& remedy) {
    std::string text = policy + ": ";
    text += reads_ ? "the writer offers " + offered + ", this entry asks for " + asked
                   : "this entry offers " + offered + ", the reader asks for " + asked;
    if (!remedy.empty()) text += "; write " + remedy;
    found_.push_back(std::move(text));
  }
  // In terms of an attribute that takes the other end's word.
  void add_attribute(const std::string& name, const std::string& offered,
                     const std::string& asked) {
    add(name, offered, asked, name + "=\"" + (reads_ ? offered : asked) + "\"");
  }
  void add_plain(std::string text) { found_.push_back(std::move(text)); }
  [[nodiscard]] std::vector<std::string> found() && { return std::move(found_); }

 private:
  const bool reads_;
  const AnnouncedQos mine_;
  const AnnouncedQos& reader_;
  const AnnouncedQos& writer_;
  std::vector<std::string> found_;
};

void compare_attributes(Comparison& pair) {
  const AnnouncedQos& asked = pair.reader();
  const AnnouncedQos& offered = pair.writer();
  if (asked.reliability > offered.reliability) {
    pair.add_attribute("reliability", word(kReliabilities, offered.reliability),
                       word(kReliabilities, asked.reliability));
  }
  if (asked.durability > offered.durability) {
    const std::string name = word(kDurabilities, asked.durability);
    const bool known = asked.durability <= 1;  // stronger ones the mapping does not have
    if (known) {
      pair.add_attribute("durability", word(kDurabilities, offered.durability), name);
    } else {
      pair.add("durability", word(kDurabilities, offered.durability), name, "");
    }
  }
  if (asked.deadline < offered.deadline) {
    pair.add("deadline", duration(offered.deadline), duration(asked.deadline),
             "a deadline= that fits, or none where the entry reads");
  }
  if (std::find(asked.representations.begin(), asked.representations.end(),
                offered.representations.front()) == asked.representations.end()) {
    pair.add("representation", word(kRepresentations, offered.representations.front()),
             list(asked.representations),
             pair.reads() ? "" : R"(representation="xcdr1" or "xcdr2")");
  }
}

// Those that no attribute changes.
void compare_others(Comparison& pair) {
  const AnnouncedQos& asked = pair.reader();
  const AnnouncedQos& offered = pair.writer();
  if (asked.ownership != offered.ownership) {
    pair.add("ownership", word(kOwnerships, offered.ownership), word(kOwnerships, asked.ownership),
             "");
  }
  if (asked.liveliness > offered.liveliness) {
    pair.add("liveliness", word(kLivelinesses, offered.liveliness),
             word(kLivelinesses, asked.liveliness), "");
  }
  if (asked.lease < offered.lease) {
    pair.add("liveliness lease", duration(offered.lease), duration(asked.lease), "");
  }
  if (asked.latency_budget < offered.latency_budget) {
    pair.add("latency budget", duration(offered.latency_budget), duration(asked.latency_budget),
             "");
  }
  if (asked.destination_order > offered.destination_order) {
    pair.add("destination order", word(kOrders, offered.destination_order),
             word(kOrders, asked.destination_order), "");
  }
}

// In the words of the mapping: names of ROS 2 where it has them.
std::string compare_types(const DdsTopic& ours, const std::string& theirs) {
  const std::string its = ours.is_ros ? readable_type(theirs) : theirs;
  std::string text =
      "type: it has " + its + ", this entry has " + (ours.is_ros ? ours.type_written : ours.type);
  text += "; if its type is right, write type=\"" + its + "\"";
  // A topic of ROS 2 has no other type.
  if (ours.is_ros && its == theirs) text += " and topic=\"" + ours.name + "\"";
  return text;
}

}  // namespace

bool may_meet(const Qos& ours, const AnnouncedQos& theirs) {
  std::size_t patience = kMostComparedOfPeer;
  return theirs.has_more_partitions ||
         share_partition(ours.partitions, theirs.partitions, patience);
}

std::vector<std::string> mismatches(const OurEnd& ours, const Peer& peer) {
  Comparison pair(ours, peer);
  if (peer.type != ours.topic.type) pair.add_plain(compare_types(ours.topic, peer.type));
  if (peer.keyed != ours.keyed) {
    pair.add_plain(peer.keyed
                       ? R"(key: its type has a key, this entry's has none; write keyed="true")"
                       : R"(key: its type has no key, this entry's has one; write keyed="false")");
  }
  compare_attributes(pair);
  compare_others(pair);
  if (!may_meet(ours.topic.qos, peer.qos)) {
    pair.add_plain("partition: it is in " + list(peer.qos.partitions) + ", this entry is in " +
                   list(ours.topic.qos.partitions));
  }
  return std::move(pair).found();
}

}  // namespace arbiter::gateway::dds
