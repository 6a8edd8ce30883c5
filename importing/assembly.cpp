#include "importing/assembly.hpp"

#include <filesystem>
#include <utility>

#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace arbiter::importing {
namespace {

constexpr const char* kOutputPort = "/base/cmd_vel:i";

NodeName node_of(const NodeParameters& parameters, const ImportOptions& options,
                 std::string default_node) {
  NodeName node = parameters.node().empty() ? NodeName{"/", std::move(default_node)}
                                            : split_node(parameters.node());
  if (!options.name_space.empty()) {
    node.name_space = options.name_space.starts_with('/') ? "" : "/";
    node.name_space += options.name_space;
  }
  return node;
}

std::string unused(const std::string& name, std::set<std::string>& used) {
  std::string result = name;
  for (int i = 2; !used.insert(result).second; ++i) result = name + "_" + std::to_string(i);
  return result;
}

}  // namespace

Assembly::Assembly(const NodeParameters& parameters, const ImportOptions& options,
                   std::string default_node, Relative relative, rules::Diagnostics& diagnostics)
    : options_(options),
      node_(node_of(parameters, options, std::move(default_node))),
      relative_(relative),
      is_ros2_(parameters.is_ros2()),
      diagnostics_(diagnostics) {}

std::string Assembly::topic_of(const MuxEntry& entry) {
  const auto topic = resolve_topic(entry.topic.value, node_, relative_);
  if (!topic) {
    diagnostics_.error("invalid-topic", entry.topic.where, problem_of_topic(entry.topic.value));
    return "";
  }
  const auto [earlier, is_new] = topics_.emplace(*topic, entry.topic.where);
  if (!is_new) {
    diagnostics_.error("same-topic", entry.topic.where,
                       "the topic " + *topic + " is given at " + rules::describe(earlier->second) +
                           " as well; a message would arrive twice, with two timeouts and two "
                           "priorities: keep one");
  }
  return *topic;
}

void Assembly::set_output(Plan& plan, const std::string& written, const rules::Location& where) {
  const std::string& name = options_.output_topic.empty() ? written : options_.output_topic;
  const auto relative = options_.output_topic.empty() ? relative_ : Relative::kToNamespace;
  const auto topic = resolve_topic(name, node_, relative);
  if (!topic) {
    diagnostics_.error("invalid-topic", where,
                       "the output " + rules::quote(name) +
                           " is not a name of a topic; write letters, digits and _ between "
                           "slashes, such as /cmd_vel, at most 200 in all");
    return;
  }
  if (const auto found = topics_.find(*topic); found != topics_.end()) {
    diagnostics_.error("loops-back", found->second,
                       "the topic " + *topic +
                           " is the output, too, so that each command would come back as an input; "
                           "rename one, or say with --output-topic what the output is remapped to");
  }
  plan.output_port = kOutputPort;
  plan.output_topic = *topic;
}

std::string Assembly::folder_of(const MuxEntry& entry, Of what) {
  std::string folder = "/";
  for (const char c : entry.name) {
    const bool fits = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                      c == '_' || c == '-' || c == '.';
    folder += fits ? c : '_';
  }
  return unused(folder, folders_[what]);
}

std::string Assembly::behaviour_of(const MuxEntry& entry) {
  std::string name;
  for (const char c : entry.name) name += c == ',' || c == '$' ? '_' : c;
  return unused(name, behaviours_);
}

void Assembly::set_types(Plan& plan, bool is_stamped, const rules::Location& where) {
  plan.domain = options_.domain;
  plan.mapping_remark = "Correct the topics if the launch file remaps them.";
  if (!is_ros2_) plan.mapping_remark += " Those of ROS 1 come and go through ros1_bridge.";
  plan.type = !options_.type.empty() ? options_.type : is_stamped ? kTwistStamped : kTwist;
  const bool is_fixed = plan.type == kTwist || plan.type == kTwistStamped;
  if (options_.idle == IdleChoice::kZero || (options_.idle == IdleChoice::kByType && is_fixed)) {
    plan.idle = "zero";
  }
  if (options_.idle == IdleChoice::kByType && !is_fixed) {
    diagnostics_.warning("nothing-when-idle", where,
                         "nothing is sent while nobody commands, since zeros are no " + plan.type +
                             "; record a sample that stops the robot and name it in the mapping "
                             "(idle=\"file:…\"), or rely on the time-out of the robot's driver");
  }
}

std::vector<std::string> file_names(const std::vector<InputFile>& files) {
  std::vector<std::string> names;
  names.reserve(files.size());
  for (const InputFile& file : files) {
    names.push_back(shm::printable(std::filesystem::path(file.path).filename().string()));
  }
  return names;
}

}  // namespace arbiter::importing
