#include "gateway/mapping/topic_reader.hpp"

#include <string>
#include <string_view>

#include "gateway/mapping/ros_names.hpp"
#include "rules/text/names.hpp"

namespace arbiter::gateway {
namespace {

constexpr std::size_t kMaxDdsName = 239;      // what a port's type may have, too
constexpr std::size_t kMaxIceoryxName = 100;  // iceoryx's own limit
constexpr std::uint32_t kMaxHistory = 16;     // of iceoryx, as Debian builds it
constexpr std::uint32_t kMaxQueue = 256;      // likewise

struct Preset {
  Reliability reliability;
  Durability durability;
  std::uint32_t depth;
};

// ROS 2's profiles (rmw/qos_profiles.h), and what its users call latched. "System default" leaves
// the choice to DDS, whose own defaults differ for readers and writers.
std::optional<Preset> read_preset(Attributes& attributes, bool is_in) {
  using enum Reliability;
  using enum Durability;
  const Preset services{kReliable, kVolatile, 10};
  return attributes.word<Preset>(
      "qos", {{"default", {kReliable, kVolatile, 10}},
              {"sensor_data", {kBestEffort, kVolatile, 5}},
              {"latched", {kReliable, kTransientLocal, 1}},
              {"system_default", {is_in ? kBestEffort : kReliable, kVolatile, 1}},
              {"services_default", services},
              {"services", services},
              {"parameters", {kReliable, kVolatile, 1000}},
              {"parameter_events", {kReliable, kVolatile, 1000}},
              {"clock", {kBestEffort, kVolatile, 1}},
              {"rosout", {kReliable, kTransientLocal, 1000}}});
}

Qos read_qos(Attributes& attributes, bool is_in, bool is_ros) {
  Qos qos;
  if (is_ros) qos.depth = 10;
  if (const auto preset = read_preset(attributes, is_in)) {
    qos.reliability = preset->reliability;
    qos.durability = preset->durability;
    qos.depth = preset->depth;
  }
  if (const auto reliability = attributes.word<Reliability>(
          "reliability",
          {{"reliable", Reliability::kReliable}, {"best_effort", Reliability::kBestEffort}})) {
    qos.reliability = *reliability;
  }
  if (const auto durability = attributes.word<Durability>(
          "durability", {{"volatile", Durability::kVolatile},
                         {"transient_local", Durability::kTransientLocal}})) {
    qos.durability = *durability;
  }
  if (const auto history = attributes.word<History>(
          "history", {{"keep_last", History::kKeepLast}, {"keep_all", History::kKeepAll}})) {
    qos.history = *history;
  }
  if (const auto depth = attributes.number("depth", 1, 10'000)) {
    qos.depth = static_cast<std::uint32_t>(*depth);
    if (qos.history == History::kKeepAll) {
      attributes.error("contradiction", "depth",
                       "depth=\"…\" means nothing with history=\"keep_all\"; remove one of them");
    }
  }
  qos.deadline = attributes.duration("deadline");
  qos.partitions = attributes.list("partition", kMaxDdsName);
  qos.keyed = attributes.boolean("keyed");
  if (!is_in) {
    qos.representation = attributes.word<Representation>(
        "representation", {{"xcdr1", Representation::kXcdr1}, {"xcdr2", Representation::kXcdr2}});
  }
  return qos;
}

// As ROS 2 would write it: "/cmd_vel" for "rt/cmd_vel", which is its name in DDS, for "cmd_vel",
// and for "~/cmd_vel", which only a node can complete.
std::string ros_topic_like(std::string_view written) {
  for (const std::string_view beginning : {"rt/", "~/"}) {
    if (written.starts_with(beginning)) written.remove_prefix(beginning.size());
  }
  const std::string name = "/" + std::string(written);
  return is_ros_topic(name) ? name : "/base/cmd_vel";
}

// A ROS 2 name goes with a ROS 2 type, and a name of DDS with one of DDS: a topic that is written
// half in one and half in the other would be found by neither.
void check_names(Attributes& attributes, DdsTopic& topic) {
  const bool has_ros_topic = topic.written.starts_with('/');
  const bool has_ros_type = topic.type_written.find('/') != std::string::npos;
  if (has_ros_topic && !is_ros_topic(topic.written)) {
    attributes.error("invalid-topic", "topic",
                     "the topic " + rules::quote(topic.written) +
                         " is no name of ROS 2; write tokens of letters, digits and '_', not a "
                         "digit first, each behind a '/', such as \"/base/cmd_vel\"");
    return;
  }
  if (has_ros_type && !is_ros_type(topic.type_written)) {
    attributes.error("invalid-type", "type",
                     "the type " + rules::quote(topic.type_written) +
                         " is no name of ROS 2; write \"package/msg/Name\", such as "
                         "\"geometry_msgs/msg/Twist\"");
    return;
  }
  topic.is_ros = has_ros_topic && has_ros_type;
  if (topic.is_ros) {
    topic.name = dds_topic_of(topic.written);
    topic.type = dds_type_of(topic.type_written);
  } else if (has_ros_topic) {
    attributes.error("invalid-type", "type",
                     "a topic of ROS 2, " + rules::quote(topic.written) +
                         ", has a type of ROS 2; write it as \"package/msg/Name\", not " +
                         rules::quote(topic.type_written));
  } else if (has_ros_type) {
    attributes.error("invalid-topic", "topic",
                     "the type is one of ROS 2, but the topic " + rules::quote(topic.written) +
                         " is not; write " + rules::quote(ros_topic_like(topic.written)) +
                         ", or for a topic that is no node's, its type as DDS has it, " +
                         rules::quote(dds_type_of(topic.type_written)));
  } else if (!is_dds_topic(topic.written)) {
    attributes.error("invalid-topic", "topic",
                     "DDS has no topic " + rules::quote(topic.written) +
                         "; write letters, digits, '_' and '/', not a digit first, and not a "
                         "name that begins with DCPS, which are those of DDS itself");
  }
}

}  // namespace

DdsTopic read_dds_topic(Attributes& attributes, bool is_in) {
  DdsTopic topic;
  topic.written = attributes.required("topic", kMaxDdsName);
  topic.type_written = attributes.required("type", kMaxDdsName);
  topic.name = topic.written;
  topic.type = topic.type_written;
  if (!topic.written.empty() && !topic.type_written.empty()) check_names(attributes, topic);
  topic.qos = read_qos(attributes, is_in, topic.is_ros);
  return topic;
}

IceoryxTopic read_iceoryx_topic(Attributes& attributes, bool is_in) {
  IceoryxTopic topic;
  topic.service = attributes.required("service", kMaxIceoryxName);
  topic.instance = attributes.required("instance", kMaxIceoryxName);
  topic.event = attributes.required("event", kMaxIceoryxName);
  if (!is_in && topic.instance == "RouDi_ID" &&
      (topic.service == "Introspection" || topic.service == "ServiceDiscovery")) {
    attributes.error("invalid-topic", "service",
                     "RouDi publishes on its own topics itself, and lets nobody else; write "
                     "another service or instance");
  }
  const auto set = [](std::uint32_t& to, std::optional<std::uint64_t> from) {
    if (from) to = static_cast<std::uint32_t>(*from);
  };
  set(topic.user_header, attributes.bytes("user_header", 0, 4096));
  if (!is_in) set(topic.history, attributes.number("history", 0, kMaxHistory));
  if (is_in) set(topic.queue, attributes.number("queue", 1, kMaxQueue));
  if (const auto alignment = attributes.bytes("alignment", 1, 4096)) {
    if ((*alignment & (*alignment - 1)) == 0) {
      topic.alignment = static_cast<std::uint32_t>(*alignment);
    } else {
      attributes.error("invalid-value", "alignment",
                       "alignment=\"…\" is a power of two; write 1, 2, 4, 8, …");
    }
  }
  return topic;
}

}  // namespace arbiter::gateway
