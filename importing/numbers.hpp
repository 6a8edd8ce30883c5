// Numbers as YAML has them. ROS 1 and ROS 2 read some spellings differently (010, 1_000, 0x10,
// 1e3, 5.0e1); those are errors.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "importing/yaml.hpp"
#include "shm/activity.hpp"

namespace arbiter::importing {

template <typename T>
struct Number {
  std::optional<T> value;
  std::string problem;  // what is wrong and what to do, where there is no value
};

Number<std::int64_t> read_integer(const YamlNode& node);

// Seconds, to the nanosecond, rounded; at most kMostSeconds either way. What is not 0 does not
// become 0, but is an error.
inline constexpr double kMostSeconds = 1e9;
Number<shm::Nanoseconds> read_seconds(const YamlNode& node);

// Whether a number is written as a whole one: 1, not 1.0.
bool is_whole(const YamlNode& node);

}  // namespace arbiter::importing
