// A mapping: which topics of another middleware pass through which ports of Arbiter.
//
//   <gateway kind="dds" domain="0">
//     <in topic="/cmd_vel_nav" type="geometry_msgs/msg/Twist" port="/Nav/cmd_vel:o"/>
//     <out port="/Base/cmd_vel:i" topic="/cmd_vel" type="geometry_msgs/msg/Twist" idle="zero"/>
//   </gateway>
//
// docs/gateways.md describes each element and attribute. What stands here has been read and
// judged: names fit, numbers are within their bounds, and what a kind does not have is absent.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rules/text/diagnostic.hpp"
#include "shm/activity.hpp"

namespace arbiter::gateway {

inline constexpr std::size_t kMaxEntries = 1024;                           // of a file
inline constexpr std::size_t kMaxSampleBytes = std::size_t{1} << 30;       // of max_size=
inline constexpr std::size_t kDefaultSampleBytes = std::size_t{64} << 10;  // where it is absent
inline constexpr std::size_t kMaxIdleBytes = std::size_t{1} << 20;         // of an idle sample
inline constexpr std::uint32_t kMaxDomain = 230;                           // of DDS

enum class Kind { kDds, kIceoryx };
// "dds", "iceoryx"
[[nodiscard]] const char* name_of(Kind kind);

// What a port has in its model: a name, with its place in the mapping.
struct Port {
  std::string name;
  rules::Location where;
};

// How a field of a sample is stored.
enum class Field { kBoolean, kI8, kU8, kI16, kU16, kI32, kU32, kI64, kU64, kF32, kF64 };
[[nodiscard]] std::size_t size_of(Field field);
// "f32", as a mapping has it; of a Boolean "Boolean".
[[nodiscard]] const char* name_of(Field field);
// Of a number: the least and the greatest finite value.
struct Range {
  long double least = 0;
  long double greatest = 0;
};
[[nodiscard]] Range range_of(Field field);

// A topic that is two sources: one is published, and the other deactivated, by what a field of the
// sample says. So a Boolean, or a number on one side of a threshold, can be read by a condition.
struct Choice {
  // One of the two at least: a model seldom asks for both.
  std::optional<Port> yes;  // true; above the threshold
  std::optional<Port> no;   // false; not above it
  Field field = Field::kBoolean;
  // In bytes, from the first byte of the sample's data: behind the encapsulation header of DDS,
  // behind the user header of iceoryx.
  std::size_t offset = 0;
  long double threshold = 0;  // an 80-bit one, so that each number of 64 bits is itself
};

// What samples are to the components of Arbiter; absent: untyped.
struct PortType {
  std::string name;
  std::size_t size = 0;  // of each sample; 0: any size up to max_size
  std::size_t alignment = 1;
};

enum class Reliability { kReliable, kBestEffort };
enum class Durability { kVolatile, kTransientLocal };
enum class History { kKeepLast, kKeepAll };
enum class Representation { kXcdr1, kXcdr2 };

// Of a reader or a writer. A preset has been taken into account; what is absent is for the
// gateway to choose by what it finds at the other end.
struct Qos {
  Reliability reliability = Reliability::kReliable;
  Durability durability = Durability::kVolatile;
  History history = History::kKeepLast;
  std::uint32_t depth = 1;                       // of kKeepLast
  std::optional<shm::Nanoseconds> deadline;      // absent: none
  std::vector<std::string> partitions;           // empty: the default one
  std::optional<bool> keyed;                     // whether the type has a key
  std::optional<Representation> representation;  // of a writer
};

struct DdsTopic {
  std::string written;       // as the file has it: "/cmd_vel"
  std::string name;          // in DDS: "rt/cmd_vel"
  std::string type_written;  // "geometry_msgs/msg/Twist"
  std::string type;          // in DDS: "geometry_msgs::msg::dds_::Twist_"
  bool is_ros = false;       // the two are written as ROS 2 writes them
  // Bytes of data that each sample of the type has in plain CDR, behind its encapsulation header;
  // absent: they vary, or nobody has said.
  std::optional<std::size_t> size;
  Qos qos;
};

struct IceoryxTopic {
  std::string service, instance, event;
  // Bytes of the user header that each chunk has, which then stands before the payload in Arbiter's
  // samples; 0: none.
  std::uint32_t user_header = 0;
  // The payload begins at a multiple of this, in chunks as in samples.
  std::uint32_t alignment = 8;
  // Of `out`: samples that a subscriber is given that comes later.
  std::uint32_t history = 0;
  std::uint32_t queue = 8;  // of `in`: samples that may wait for the gateway

  // Where the payload stands in Arbiter's samples: behind the user header, aligned.
  [[nodiscard]] std::size_t padded_header() const {
    return (std::size_t{user_header} + alignment - 1) / alignment * alignment;
  }
};

// What is sent while an input port is idle.
struct Idle {
  enum class Kind { kNothing, kZero, kFile } kind = Kind::kNothing;
  // The sample: for DDS with its encapsulation header, for iceoryx with its user header.
  std::vector<std::byte> sample;
  std::string path;  // of kFile
};

struct Entry {
  enum class Direction { kIn, kOut } direction = Direction::kIn;
  rules::Location where;
  bool has_errors = false;  // what was refused is not in it
  // Of `in`, exactly one of these two.
  std::optional<Port> port;
  std::optional<Choice> choice;
  std::optional<PortType> type;
  std::size_t max_size = kDefaultSampleBytes;  // of a sample in Arbiter, in bytes
  // Of `in`: a sample that is older never arrives, even where T is longer, or for ever.
  std::optional<shm::Nanoseconds> max_age;
  std::uint32_t queue = 8;  // of `out`: samples of each source that may wait at the port
  Idle idle;                // of `out`
  // Exactly one of these, by the kind of the gateway.
  std::optional<DdsTopic> dds;
  std::optional<IceoryxTopic> iceoryx;

  [[nodiscard]] bool is_in() const { return direction == Direction::kIn; }
  // Its output ports, or its input port.
  [[nodiscard]] std::vector<const Port*> ports() const;
  // For people: "DDS topic rt/cmd_vel", "iceoryx Radar/Front/Objects".
  [[nodiscard]] std::string outside() const;
};

// Whether both have the same user header before the payload in Arbiter's samples, at the same
// place. An `out` entry whose samples begin otherwise than those that come would send bytes of a
// header as data, or data as a header.
[[nodiscard]] bool have_one_header(const Entry& in, const Entry& out);
// "a user header of 8 bytes", "no user header".
[[nodiscard]] std::string header_text(const Entry& entry);
// What `out` must have for samples of `in`: "write user_header=\"8\" at the <out>".
[[nodiscard]] std::string header_advice(const Entry& in, const Entry& out);

struct Gateway {
  Kind kind = Kind::kDds;
  rules::Location where;
  // DDS; empty: as Cyclone's own configuration says (CYCLONEDDS_URI).
  std::optional<std::uint32_t> domain;  // absent: ROS_DOMAIN_ID, else 0
  std::vector<std::string> interfaces;  // names or addresses of network interfaces
  std::vector<std::string> peers;       // addresses of hosts that multicast does not reach
  std::string configuration;            // a file of Cyclone's, beside the mapping
  std::string configuration_text;       // what stood there when the mapping was read
  std::vector<Entry> entries;           // in document order
};

// What ROS_DOMAIN_ID says to a gateway that names no domain: 0 where it is not set or empty;
// nothing where it is no number from 0 to kMaxDomain.
[[nodiscard]] std::optional<std::uint32_t> domain_of_environment();

// Whether they join a domain in the same way, if they join the same.
[[nodiscard]] bool have_one_configuration(const Gateway& a, const Gateway& b);

struct Mapping {
  std::string path;
  std::vector<Gateway> gateways;
};

}  // namespace arbiter::gateway
