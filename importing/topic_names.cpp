#include "importing/topic_names.hpp"

#include <algorithm>

#include "rules/text/names.hpp"

namespace arbiter::importing {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

bool is_token(std::string_view token) {
  return !token.empty() && is_letter(token.front()) &&
         std::all_of(token.begin(), token.end(),
                     [](char c) { return is_letter(c) || is_digit(c); });
}

// "/a/b"
bool is_absolute(std::string_view name) {
  constexpr std::size_t kLongest = 200;
  if (name.empty() || name.size() > kLongest) return false;
  while (!name.empty()) {
    if (name.front() != '/') return false;
    name.remove_prefix(1);
    const std::size_t end = std::min(name.find('/'), name.size());
    if (!is_token(name.substr(0, end))) return false;
    name.remove_prefix(end);
  }
  return true;
}

}  // namespace

NodeName split_node(std::string_view node) {
  const std::size_t slash = node.rfind('/');
  if (slash == std::string_view::npos) return {"/", std::string(node)};
  const std::string_view name_space = node.substr(0, slash);
  return {name_space.empty() ? "/" : std::string(name_space), std::string(node.substr(slash + 1))};
}

std::optional<std::string> resolve_topic(std::string_view written, const NodeName& node,
                                         Relative relative) {
  const std::string base = node.name_space == "/" ? "" : node.name_space;
  std::string name;
  if (written.starts_with('/')) {
    name = written;
  } else if (written.starts_with("~/")) {
    name = base + "/" + node.name + std::string(written.substr(1));
  } else if (relative == Relative::kToNode) {
    name = base + "/" + node.name + "/" + std::string(written);
  } else {
    name = base + "/" + std::string(written);
  }
  if (!is_absolute(name)) return {};
  return name;
}

std::string problem_of_topic(std::string_view written) {
  return rules::quote(written) +
         " is not a name of a topic; write letters, digits and _ between slashes, such as "
         "/robot/joy_vel, at most 200 in all";
}

}  // namespace arbiter::importing
