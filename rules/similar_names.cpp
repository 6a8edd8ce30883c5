#include "rules/similar_names.hpp"

#include <algorithm>
#include <bit>
#include <map>
#include <utility>

namespace arbiter::rules {
namespace {

bool is_digit(char byte) { return byte >= '0' && byte <= '9'; }
bool is_upper(char byte) { return byte >= 'A' && byte <= 'Z'; }
bool is_lower(char byte) { return byte >= 'a' && byte <= 'z'; }
// Beyond ASCII everything is taken for a letter.
bool is_of_word(char byte) {
  return is_digit(byte) || is_upper(byte) || is_lower(byte) || (byte & 0x80) != 0;
}
char lower(char byte) { return is_upper(byte) ? static_cast<char>(byte - 'A' + 'a') : byte; }

// ":o" and ":i" say which end of a component a port is.
std::string_view without_end(std::string_view name) {
  const bool has_end = name.ends_with(":o") || name.ends_with(":i");
  return has_end ? name.substr(0, name.size() - 2) : name;
}

// What is left of a name of which neither case nor punctuation counts, but between digits: 1/11 is
// not 11/1.
std::string plain(std::string_view name) {
  std::string result;
  bool follows_punctuation = false;
  for (const char byte : without_end(name)) {
    if (is_of_word(byte)) {
      const bool splits = follows_punctuation && is_digit(byte) && !result.empty();
      if (splits && is_digit(result.back())) result += '/';
      result += lower(byte);
    }
    follows_punctuation = !is_of_word(byte);
  }
  return result;
}

// In lower case: /l_arm/camA:o is l, arm, cam, a, o.
std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words;
  char before = '/';
  for (const char byte : name) {
    if (is_of_word(byte)) {
      const bool begins = !is_of_word(before) || (is_lower(before) && is_upper(byte));
      if (begins) words.emplace_back();
      words.back() += lower(byte);
    }
    before = byte;
  }
  return words;
}

// Whether so many slips make one of the other: a letter too many, too few or another, or two
// neighbours exchanged.
bool are_within(std::string_view a, std::string_view b, std::size_t slips) {
  while (!a.empty() && !b.empty() && a.front() == b.front()) {
    a.remove_prefix(1);
    b.remove_prefix(1);
  }
  while (!a.empty() && !b.empty() && a.back() == b.back()) {
    a.remove_suffix(1);
    b.remove_suffix(1);
  }
  const std::size_t shorter = std::min(a.size(), b.size());
  const std::size_t longer = std::max(a.size(), b.size());
  if (shorter == 0) return longer <= slips;
  if (slips == 0 || longer - shorter > slips) return false;
  if (are_within(a.substr(1), b.substr(1), slips - 1)) return true;
  if (are_within(a.substr(1), b, slips - 1) || are_within(a, b.substr(1), slips - 1)) return true;
  return shorter >= 2 && a[0] == b[1] && a[1] == b[0] &&
         are_within(a.substr(2), b.substr(2), slips - 1);
}

bool are_exchanged(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  std::size_t at = 0;
  while (a[at] == b[at]) ++at;
  return at + 1 < a.size() && a[at] == b[at + 1] && a[at + 1] == b[at] &&
         a.substr(at + 2) == b.substr(at + 2);
}

// Two words of otherwise equal names. Short words are near each other by nature, first and last
// letters are seldom wrong, and what differs there is often meant: get and set, hand and hands.
Resemblance compare_words(const NameWord& one, const NameWord& other) {
  if (one.letters == other.letters) return Resemblance::kNone;  // siblings
  const std::size_t length = std::max(one.letters.size(), other.letters.size());
  const std::string &a = one.text, &b = other.text;
  const bool has_ends = a.front() == b.front() && a.back() == b.back();
  if (length < 3) return Resemblance::kNone;
  if (are_exchanged(a, b)) return has_ends ? Resemblance::kClose : Resemblance::kSlip;
  if (length >= 4 && are_within(a, b, 1)) {
    return has_ends && length >= 5 ? Resemblance::kClose : Resemblance::kSlip;
  }
  if (length >= 6 && a.front() == b.front() && are_within(a, b, 2)) {
    return has_ends && length >= 9 ? Resemblance::kClose : Resemblance::kSlip;
  }
  return Resemblance::kNone;
}

constexpr const char* kAnyWord = "*";  // no word is called so

// The name with one of its words left open, for each of them. Names that differ in one word share
// such a key.
std::string key_without(const std::vector<std::string>& words, std::size_t left_open) {
  std::string key;
  for (std::size_t i = 0; i < words.size(); ++i) {
    key += '/';
    key += i == left_open ? kAnyWord : words[i];
  }
  return key;
}

}  // namespace

NameWord::NameWord(std::string word) : text(std::move(word)) {
  for (const char byte : text) {
    characters |= std::uint64_t{1} << (static_cast<unsigned char>(byte) & 63);
    if (!is_digit(byte)) letters += byte;
  }
}

NameIndex::NameIndex(std::vector<std::string_view> names) : names_(std::move(names)) {
  for (std::size_t i = 0; i < names_.size(); ++i) {
    by_plain_[plain(names_[i])].push_back(i);
    const auto words = words_of(names_[i]);
    for (std::size_t at = 0; at < words.size(); ++at) {
      by_key_[key_without(words, at)].emplace_back(NameWord(words[at]), i);
    }
  }
}

std::vector<SimilarName> NameIndex::similar_to(std::string_view name) const {
  std::map<std::size_t, Resemblance> found;
  if (const auto same = by_plain_.find(plain(name)); same != by_plain_.end()) {
    for (const std::size_t i : same->second) found.emplace(i, Resemblance::kClose);
  }
  const auto words = words_of(name);
  for (std::size_t at = 0; at < words.size(); ++at) {
    const auto others = by_key_.find(key_without(words, at));
    if (others == by_key_.end()) continue;
    const NameWord word(words[at]);
    for (const auto& [other, i] : others->second) {
      if (std::popcount(word.characters ^ other.characters) > 4) continue;
      const Resemblance how = compare_words(word, other);
      if (how != Resemblance::kNone) found.emplace(i, how);
    }
  }
  std::vector<SimilarName> result;
  for (const auto& [i, how] : found) {
    if (names_[i] != name) result.push_back({names_[i], how});
  }
  return result;
}

}  // namespace arbiter::rules
