// Where a multiplexer's parameters are in the files of a robot: ROS 2's, of one or more nodes, or a
// plain file, as ROS 1 loads it.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "importing/yaml.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::importing {

struct InputFile {
  std::string path;
  std::string content;
};

// A multiplexer, and what a set of parameters must have at least one of to be that one's.
struct MultiplexerKind {
  std::string_view name;
  std::vector<std::string_view> parameters;
};
inline const MultiplexerKind twist_mux_kind{"twist_mux", {"topics", "locks"}};
inline const MultiplexerKind cmd_vel_mux_kind{"cmd_vel_mux", {"subscribers"}};

// The parameters of one node that a file has.
struct ParameterSet {
  std::string node;  // "/robot/twist_mux", or a pattern; empty: the file leaves it open
  bool is_ros2 = false;
  const YamlNode* parameters = nullptr;  // a map
};

// One parameter, and the set that it is in.
struct Parameter {
  const ParameterSet* set = nullptr;
  const YamlEntry* entry = nullptr;
};

// The parameters of one node, from all files.
class NodeParameters {
 public:
  // Those of a multiplexer of that kind. `node` chooses where there are several: its full name, or
  // the end of it; empty: there must be one. Reports what is wrong, such as files of the other
  // kind, and then has no sets.
  NodeParameters(const std::vector<InputFile>& files, const MultiplexerKind& kind,
                 const MultiplexerKind& other, const std::string& node,
                 rules::Diagnostics& diagnostics);
  NodeParameters(const NodeParameters&) = delete;
  NodeParameters& operator=(const NodeParameters&) = delete;

  [[nodiscard]] const std::vector<ParameterSet>& sets() const { return sets_; }
  [[nodiscard]] bool is_ros2() const { return !sets_.empty() && sets_.front().is_ros2; }
  // As the files or the user say; empty: nobody does.
  [[nodiscard]] const std::string& node() const { return node_; }
  // Reports a parameter that several files give.
  [[nodiscard]] std::optional<Parameter> find(std::string_view name,
                                              rules::Diagnostics& diagnostics) const;

 private:
  void choose(const std::vector<InputFile>& files, const MultiplexerKind& kind,
              const MultiplexerKind& other, const std::string& node,
              rules::Diagnostics& diagnostics);
  void require_one_form(rules::Diagnostics& diagnostics);
  [[nodiscard]] std::string where_else(const MultiplexerKind& other) const;

  std::vector<YamlNode> documents_;
  std::vector<ParameterSet> sets_;
  std::string node_;
};

}  // namespace arbiter::importing
