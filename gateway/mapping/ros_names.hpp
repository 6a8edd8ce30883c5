// Names of ROS 2, as people write them and as DDS has them.
//
//   topic  /cmd_vel                  rt/cmd_vel
//   type   geometry_msgs/msg/Twist   geometry_msgs::msg::dds_::Twist_
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/mapping/mapping.hpp"

namespace arbiter::gateway {

// "/a/b_c": tokens of letters, digits and underscores, each behind a '/'.
[[nodiscard]] bool is_ros_topic(std::string_view name);
// "package/msg/Name"; also srv and action, whose parts are types too.
[[nodiscard]] bool is_ros_type(std::string_view name);

// What Cyclone takes for the name of a topic; its own topics, DCPS…, it lets nobody have. Of a name
// that is not empty.
[[nodiscard]] bool is_dds_topic(std::string_view name);

// Of names for which those of ROS 2 are true.
[[nodiscard]] std::string dds_topic_of(std::string_view ros_topic);
[[nodiscard]] std::string dds_type_of(std::string_view ros_type);

// "geometry_msgs/msg/Twist" for its name in DDS; any other name as it is.
[[nodiscard]] std::string readable_type(std::string_view dds_type);

// How many bytes of CDR a sample has behind its encapsulation header, for those of ROS 2's common
// types that have the same number always: they contain no string, no sequence. By their ROS name.
[[nodiscard]] std::optional<std::size_t> fixed_size_of(std::string_view ros_type);
// What each of their fields is.
[[nodiscard]] std::optional<Field> field_of(std::string_view ros_type);
// Common ones that begin with a std_msgs/msg/Header: with a time, and the name of a frame.
[[nodiscard]] bool has_header(std::string_view ros_type);
// Where that name's length is, four bytes; it counts the final zero.
inline constexpr std::size_t kFrameLengthOffset = 8;
inline constexpr std::size_t kLeastHeader = kFrameLengthOffset + 4 + 1;  // an empty name's
// Of one that is a header and fields of one size, such as TwistStamped: how many bytes it has if
// its frame's name is empty.
[[nodiscard]] std::optional<std::size_t> size_without_frame(std::string_view ros_type);
// Common ones of which zero bytes are no sample, since they contain a string.
[[nodiscard]] bool has_strings(std::string_view ros_type);

}  // namespace arbiter::gateway
