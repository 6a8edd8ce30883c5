// The entries of a multiplexer's lists: name, topic, timeout, priority. Typed, each value with its
// place; what is missing or has another type has been reported.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "importing/parameters.hpp"
#include "importing/yaml.hpp"
#include "rules/text/diagnostic.hpp"
#include "shm/activity.hpp"

namespace arbiter::importing {

template <typename T>
struct Value {
  T value{};
  rules::Location where{};
};

struct MuxEntry {
  std::string name;  // blanks collapsed
  rules::Location where;
  Value<std::string> topic;
  Value<shm::Nanoseconds> timeout;  // as written, even 0 or below it
  Value<std::int64_t> priority;
  std::string description;  // short_desc
};

struct EntryRules {
  std::string program;           // "twist_mux", for messages
  bool has_description = false;  // short_desc
  bool wants_fraction = true;    // refuses a timeout that is written as a whole number
  // What it does not take of what is a number, and what to do; empty: nothing. Here, so that all
  // that is wrong with an entry is said at once.
  std::string (*problem_of_timeout)(shm::Nanoseconds) = [](shm::Nanoseconds) {
    return std::string();
  };
  std::string (*problem_of_priority)(std::int64_t) = [](std::int64_t) { return std::string(); };
};

// Those of a parameter that has been found: a list, each with its name in it, as in ROS 1, or a map
// by name, as in ROS 2, in the order in which ROS 2 has them, which is not the file's.
std::vector<MuxEntry> read_entries(const Parameter& parameter, const EntryRules& rules,
                                   rules::Diagnostics& diagnostics);

// A Boolean parameter; nothing if it is none, which is reported.
std::optional<bool> read_boolean(const YamlEntry& entry, rules::Diagnostics& diagnostics);

// "0.5 s", "100 ms" would be another number than people wrote.
std::string in_seconds(shm::Nanoseconds timeout);

}  // namespace arbiter::importing
