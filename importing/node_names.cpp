#include "importing/node_names.hpp"

#include <algorithm>
#include <cstddef>

namespace arbiter::importing {
namespace {

constexpr std::string_view kOneWord = "*";
constexpr std::string_view kAnyWords = "**";

// The first word of "/robot/mux", which loses it.
std::string_view take_word(std::string_view& name) {
  if (name.starts_with('/')) name.remove_prefix(1);
  const std::string_view word = name.substr(0, std::min(name.find('/'), name.size()));
  name.remove_prefix(word.size());
  return word;
}

}  // namespace

bool is_good_pattern(std::string_view pattern) {
  while (!pattern.empty()) {
    const std::string_view word = take_word(pattern);
    if (is_pattern(word) && word != kOneWord && word != kAnyWords) return false;
  }
  return true;
}

bool is_of_every_node(std::string_view pattern) {
  if (pattern.empty()) return false;
  while (!pattern.empty()) {
    if (take_word(pattern) != kAnyWords) return false;
  }
  return true;
}

bool fits_node(std::string_view pattern, std::string_view node) {
  constexpr std::size_t kLongest = 255;  // of ROS 2; also what bounds the work
  if (node.empty() || node.size() > kLongest || is_pattern(node)) return false;
  // Where to go on if a later word does not fit: the last `**` then has one word more.
  bool has_any_words = false;
  std::string_view pattern_behind;
  std::string_view node_behind;
  while (!pattern.empty() || !node.empty()) {
    if (!pattern.empty()) {
      std::string_view rest = pattern;
      const std::string_view word = take_word(rest);
      if (word == kAnyWords) {
        has_any_words = true;
        pattern = pattern_behind = rest;
        node_behind = node;
        continue;
      }
      std::string_view node_rest = node;
      if (!node.empty() && (take_word(node_rest) == word || word == kOneWord)) {
        pattern = rest;
        node = node_rest;
        continue;
      }
    }
    if (!has_any_words || node_behind.empty()) return false;
    take_word(node_behind);
    pattern = pattern_behind;
    node = node_behind;
  }
  return true;
}

}  // namespace arbiter::importing
