#include "importing/parameters.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "importing/node_names.hpp"
#include "rules/text/names.hpp"
#include "rules/text/text_file.hpp"

namespace arbiter::importing {
namespace {

constexpr std::string_view kRosParameters = "ros__parameters";

// A key of the way down to a node: "/robot/twist_mux", or "robot" and "twist_mux" below it.
std::string join(const std::string& path, std::string_view key) {
  while (key.starts_with('/')) key.remove_prefix(1);
  while (key.ends_with('/')) key.remove_suffix(1);
  return path + "/" + std::string(key);
}

class Finder {
 public:
  Finder(const std::vector<std::string_view>& wanted, std::vector<ParameterSet>& found,
         rules::Diagnostics& diagnostics)
      : wanted_(wanted), found_(found), diagnostics_(diagnostics) {}

  void look_in(const YamlNode& map, const std::string& path) {
    if (const YamlEntry* parameters = map.find(kRosParameters)) {
      refuse_dots(parameters->value);
      if (has_wanted(parameters->value) && !is_of_no_node(path, *parameters)) {
        found_.push_back({path, true, &parameters->value});
      }
    } else if (has_wanted(map)) {
      found_.push_back({path, false, &map});
      return;
    }
    for (const YamlEntry& entry : map.entries) {
      if (entry.key.text == kRosParameters || is_misspelt(entry)) continue;
      look_in(entry.value, join(path, entry.key.text));
    }
  }

 private:
  // ROS 2 takes "topics.joystick.priority" for the priority of "joystick" in `topics`.
  void refuse_dots(const YamlNode& parameters) {
    for (const YamlEntry& entry : parameters.entries) {
      const std::string& key = entry.key.text;
      const auto dot = key.find('.');
      if (dot == std::string::npos) continue;
      std::string first = key.substr(0, dot);
      if (std::find(wanted_.begin(), wanted_.end(), first) == wanted_.end()) continue;
      diagnostics_.error("dotted-name", entry.key.where,
                         "ROS 2 reads " + rules::quote(key) +
                             " as a part of a map, and the import does not; write the map: `" +
                             first.append(": {NAME: {topic: …}}`"));
      return;  // one for all of them
    }
  }

  bool is_of_no_node(const std::string& path, const YamlEntry& parameters) {
    if (is_good_pattern(path)) return false;
    diagnostics_.warning("unknown-key", parameters.key.where,
                         "ROS 2 takes `*` and `**` as whole words between slashes only, so that no "
                         "node has the parameters of " +
                             rules::quote(path) + "; write the words");
    return true;
  }

  // Taken for a node, it would be a part of each topic's name.
  bool is_misspelt(const YamlEntry& entry) {
    if (!has_wanted(entry.value)) return false;
    const auto meant = rules::find_similar(entry.key.text, {kRosParameters});
    if (!meant) return false;
    diagnostics_.error("unknown-key", entry.key.where,
                       "ROS 2 does not read " + rules::quote(entry.key.text) +
                           ", so that no node has the parameters in it; did you mean " +
                           rules::quote(*meant) + "?");
    return true;
  }

  // A word alone, such as a node's own parameter `topics: 3`, is not what is looked for.
  [[nodiscard]] bool has_wanted(const YamlNode& map) const {
    return std::any_of(wanted_.begin(), wanted_.end(), [&](std::string_view name) {
      const YamlEntry* entry = map.find(name);
      return entry != nullptr && (!entry->value.is_scalar() || entry->value.is_null());
    });
  }

  const std::vector<std::string_view>& wanted_;
  std::vector<ParameterSet>& found_;
  rules::Diagnostics& diagnostics_;
};

std::string in_words(const std::vector<std::string_view>& names) {
  std::string text;
  for (const std::string_view name : names) {
    text += (text.empty() ? "`" : " or `") + std::string(name) + "`";
  }
  return text;
}

using Names = std::set<std::string>;

// Whatever a file has for names.
std::string in_words(const Names& nodes) {
  std::vector<std::string> quoted;
  quoted.reserve(nodes.size());
  for (const std::string& node : nodes) quoted.push_back(rules::quote(node));
  return rules::enumerate(quoted);
}

std::string choose_one_of(const Names& nodes) {
  const auto example = std::find_if_not(nodes.begin(), nodes.end(), is_pattern);
  return example == nodes.end() ? "give the node's full name with --node"
                                : "choose one by its full name: --node " + rules::quote(*example) +
                                      (nodes.size() > 1 ? ", for example" : "");
}

// The nodes that files name, and the patterns, but for that of every node.
struct NamesOfFiles {
  explicit NamesOfFiles(const std::vector<ParameterSet>& sets) {
    for (const ParameterSet& set : sets) {
      if (set.node.empty() || is_of_every_node(set.node)) continue;
      (is_pattern(set.node) ? patterns : nodes).insert(set.node);
    }
  }
  [[nodiscard]] Names all() const {
    Names all = nodes;
    all.insert(patterns.begin(), patterns.end());
    return all;
  }

  Names nodes;
  Names patterns;
};

// Those among which nobody has chosen; one, or none: that is it.
Names candidates_of(const NamesOfFiles& names) {
  if (names.nodes.size() > 1) return names.nodes;
  if (names.nodes.empty()) return names.patterns;
  Names result = names.nodes;
  for (const std::string& pattern : names.patterns) {
    if (!fits_node(pattern, *names.nodes.begin())) result.insert(pattern);
  }
  return result;
}

// Those that somebody means by a full name, or by the end of one.
Names candidates_of(const NamesOfFiles& names, const std::string& node) {
  const std::string full = join("", node);
  if (names.nodes.count(full) != 0 || node.starts_with('/')) return {full};
  Names result;
  for (const std::string& each : names.nodes) {
    if (each.ends_with(full)) result.insert(each);
  }
  return result.empty() ? Names{full} : result;
}

bool is_for(const std::string& name, const std::string& node) {
  if (name.empty() || node.empty()) return true;  // the file or the user leaves it open
  return is_pattern(name) ? fits_node(name, node) : name == node;
}

}  // namespace

NodeParameters::NodeParameters(const std::vector<InputFile>& files, const MultiplexerKind& kind,
                               const MultiplexerKind& other, const std::string& node,
                               rules::Diagnostics& diagnostics) {
  documents_.reserve(files.size());  // sets_ points into them
  for (const InputFile& file : files) {
    const rules::TextFile text(file.path, file.content);
    auto document = parse_yaml(text, diagnostics);
    if (!document) continue;
    documents_.push_back(std::move(*document));
    Finder(kind.parameters, sets_, diagnostics).look_in(documents_.back(), "");
  }
  if (diagnostics.has_errors()) {
    sets_.clear();
  } else {
    choose(files, kind, other, node, diagnostics);
  }
}

void NodeParameters::choose(const std::vector<InputFile>& files, const MultiplexerKind& kind,
                            const MultiplexerKind& other, const std::string& node,
                            rules::Diagnostics& diagnostics) {
  const std::string wanted = in_words(kind.parameters);
  const NamesOfFiles names(sets_);
  const Names candidates = node.empty() ? candidates_of(names) : candidates_of(names, node);
  if (candidates.size() > 1) {
    const auto first = std::find_if(sets_.begin(), sets_.end(), [&](const ParameterSet& set) {
      return candidates.count(set.node) != 0;
    });
    diagnostics.error("several-nodes", first->parameters->where,
                      (node.empty() ? "several nodes have "
                                    : "several nodes called " + rules::quote(node) + " have ") +
                          wanted + ": " + in_words(candidates) + "; " + choose_one_of(candidates));
    sets_.clear();
    return;
  }
  // A pattern alone leaves it open which node it is.
  if (!candidates.empty() && !(node.empty() && is_pattern(*candidates.begin()))) {
    node_ = *candidates.begin();
  }
  std::erase_if(sets_, [&](const ParameterSet& set) { return !is_for(set.node, node_); });
  if (sets_.empty()) {
    const rules::Location start{files.empty() ? "" : files.front().path, 1, 1};
    const Names all = names.all();
    if (all.empty()) {
      diagnostics.error("nothing-to-import", start,
                        "no node has " + wanted + " here" + where_else(other));
    } else {
      diagnostics.error("no-such-node", start,
                        "the node " + rules::quote(node_) + " has no " + wanted + " here, but " +
                            in_words(all) + (all.size() == 1 ? " has; " : " have; ") +
                            choose_one_of(all));
    }
    return;
  }
  require_one_form(diagnostics);
}

void NodeParameters::require_one_form(rules::Diagnostics& diagnostics) {
  for (const ParameterSet& set : sets_) {
    if (set.is_ros2 == sets_.front().is_ros2) continue;
    diagnostics.error("mixed-forms", set.parameters->where,
                      "one file is of ROS 2 (`ros__parameters`) and one is not; import files of "
                      "one multiplexer");
    sets_.clear();
    return;
  }
}

// What to do where nothing of the kind that is wanted was found.
std::string NodeParameters::where_else(const MultiplexerKind& other) const {
  rules::Diagnostics passed_over;  // it is not imported as that
  for (const YamlNode& document : documents_) {
    std::vector<ParameterSet> found;
    Finder(other.parameters, found, passed_over).look_in(document, "");
    if (found.empty()) continue;
    std::string text = ", but " + in_words(other.parameters) + ", as a ";
    text.append(other.name).append(" has; write: arbiter import ").append(other.name);
    return text;
  }
  return "; is this the multiplexer's file of parameters?";
}

std::optional<Parameter> NodeParameters::find(std::string_view name,
                                              rules::Diagnostics& diagnostics) const {
  std::optional<Parameter> found;
  for (const ParameterSet& set : sets_) {
    const YamlEntry* entry = set.parameters->find(name);
    if (entry == nullptr || entry->value.is_null()) continue;
    if (found) {
      diagnostics.error("given-twice", entry->key.where,
                        "`" + std::string(name) + "` is given at " +
                            rules::describe(found->entry->key.where) +
                            " as well; import one of them");
      continue;
    }
    found = Parameter{&set, entry};
  }
  return found;
}

}  // namespace arbiter::importing
