// A small YAML document as a tree in which everything knows its place. libyaml reads it, as it does
// for ROS 2, and stays behind this header.
//
// Files come from anywhere, so what could make a small file large, or a reader and ROS differ, is
// an error: aliases, merge keys, tags, keys that are given twice, more than one document.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rules/text/diagnostic.hpp"
#include "rules/text/text_file.hpp"

namespace arbiter::importing {

inline constexpr std::size_t kMaxYamlBytes = 1u << 20;
inline constexpr std::size_t kMaxYamlNodes = 50'000;
inline constexpr int kMaxYamlDepth = 32;

struct YamlEntry;

struct YamlNode {
  enum class Kind { kScalar, kSequence, kMap };
  Kind kind = Kind::kScalar;
  std::string text;       // of a scalar
  bool is_plain = false;  // a scalar without quotes, which may be a number
  rules::Location where;
  std::vector<YamlNode> items;     // of a sequence
  std::vector<YamlEntry> entries;  // of a map, in the order of the file

  [[nodiscard]] bool is_scalar() const { return kind == Kind::kScalar; }
  [[nodiscard]] bool is_sequence() const { return kind == Kind::kSequence; }
  [[nodiscard]] bool is_map() const { return kind == Kind::kMap; }
  // `key:` with nothing behind it, `~` or `null`.
  [[nodiscard]] bool is_null() const;
  // Of a map; nullptr: it has no such key, or this is no map.
  [[nodiscard]] const YamlEntry* find(std::string_view key) const;
};

struct YamlEntry {
  YamlNode key;
  YamlNode value;
};

// Reports the first thing that is wrong with the document, and returns nothing.
std::optional<YamlNode> parse_yaml(const rules::TextFile& file, rules::Diagnostics& diagnostics);

}  // namespace arbiter::importing
