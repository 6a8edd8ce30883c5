// Names of topics as ROS resolves them, without remapping.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace arbiter::importing {

struct NodeName {
  std::string name_space;  // "/" or "/robot"
  std::string name;        // "twist_mux"
};

// "/robot/twist_mux" taken apart.
NodeName split_node(std::string_view node);

// What names without a slash in front are relative to.
enum class Relative { kToNamespace, kToNode };

// "/robot/joy_vel" of "joy_vel"; nothing if that is no name of a topic.
std::optional<std::string> resolve_topic(std::string_view written, const NodeName& node,
                                         Relative relative);
// What to say of one that is none.
std::string problem_of_topic(std::string_view written);

}  // namespace arbiter::importing
