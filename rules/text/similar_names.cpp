#include "rules/text/similar_names.hpp"

#include <algorithm>
#include <bit>
#include <functional>
#include <iterator>
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

// ":o" and ":i" say which end of a component a port is, and so does what is mistaken for them.
std::string_view without_end(std::string_view name) {
  while (name.ends_with('/')) name.remove_suffix(1);
  if (name.size() < 2 || name[name.size() - 2] != ':') return name;
  const char end = lower(name.back());
  return end == 'o' || end == 'i' ? name.substr(0, name.size() - 2) : name;
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

// Two words of otherwise equal names, which are no siblings. Short words are near each other by
// nature, first and last letters are seldom wrong, and what differs there is often meant: get and
// set, hand and hands.
Resemblance compare_words(const NameWord& one, const NameWord& other) {
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

// The parts between slashes, each as plain() has it.
std::vector<std::string> segments_of(std::string_view name) {
  std::vector<std::string> segments;
  name = without_end(name);
  for (std::size_t first = 0; first < name.size();) {
    const std::size_t slash = std::min(name.find('/', first), name.size());
    if (slash > first) segments.push_back(plain(name.substr(first, slash - first)));
    first = slash + 1;
  }
  return segments;
}

// Of a list of words the sum of what place and text of each come to, so that leaving one out is a
// subtraction. Those who find each other by it compare the words.
std::uint64_t hash_at(std::size_t place, const std::string& text) {
  std::uint64_t bits = std::hash<std::string>{}(text) + 0x9E3779B97F4A7C15U * (place + 1);
  bits = (bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9U;
  bits = (bits ^ (bits >> 27)) * 0x94D049BB133111EBU;
  return bits ^ (bits >> 31);
}

// Of the words, each of them left open in turn. How many there are, and which is open, counts.
std::vector<std::uint64_t> hashes_of_patterns(const std::vector<NameWord>& words) {
  std::uint64_t all = words.size();
  for (std::size_t i = 0; i < words.size(); ++i) all += hash_at(i, words[i].text);
  std::vector<std::uint64_t> hashes;
  for (std::size_t i = 0; i < words.size(); ++i) {
    hashes.push_back(all - hash_at(i, words[i].text) + hash_at(i, "*"));  // no word is called so
  }
  return hashes;
}

// Places are counted from the end, for it is the front that is left out.
std::uint64_t hash_of_segments(const std::vector<std::string>& segments) {
  std::uint64_t all = 0;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    all += hash_at(segments.size() - i, segments[i]);
  }
  return all;
}

// Of a name without its first segments, or without an inner one; the last one always stays.
std::vector<std::uint64_t> hashes_of_shortened(const std::vector<std::string>& segments) {
  std::vector<std::uint64_t> hashes;
  const std::size_t count = segments.size();
  std::uint64_t rest = hash_of_segments(segments);
  std::uint64_t before = 0;  // those before the one that is left out, which come a place nearer
  for (std::size_t i = 0; i + 1 < count; ++i) {
    rest -= hash_at(count - i, segments[i]);
    hashes.push_back(rest);
    if (i > 0) hashes.push_back(before + rest);
    before += hash_at(count - i - 1, segments[i]);
  }
  return hashes;
}

// Whether the shorter one is the longer one without its first segments, or without an inner one.
bool is_shortened(const std::vector<std::string>& longer, const std::vector<std::string>& shorter) {
  if (shorter.empty() || shorter.size() >= longer.size()) return false;
  const auto [at, there] = std::mismatch(shorter.rbegin(), shorter.rend(), longer.rbegin());
  if (at == shorter.rend()) return true;
  return at != shorter.rbegin() && shorter.size() + 1 == longer.size() &&
         std::equal(at, shorter.rend(), there + 1);
}

bool have_same_pattern(const std::vector<NameWord>& one, const std::vector<NameWord>& other,
                       std::size_t open) {
  if (one.size() != other.size()) return false;
  for (std::size_t i = 0; i < one.size(); ++i) {
    if (i != open && one[i].text != other[i].text) return false;
  }
  return true;
}

template <typename Entries>
auto entries_of(const Entries& entries, std::uint64_t hash) {
  const auto is_before = [](const auto& a, const auto& b) { return a.hash < b.hash; };
  const auto [first, last] = std::equal_range(entries.begin(), entries.end(),
                                              typename Entries::value_type{hash, 0, 0}, is_before);
  return std::span(first, last);
}

}  // namespace

NameWord::NameWord(std::string word) : text(std::move(word)) {
  for (const char byte : text) {
    characters |= std::uint64_t{1} << (static_cast<unsigned char>(byte) & 63);
    if (!is_digit(byte)) letters += byte;
  }
}

NameIndex::NameIndex(std::vector<std::string_view> names, std::size_t max_compared_bytes)
    : names_(std::move(names)), bytes_left_(max_compared_bytes) {
  for (std::uint32_t i = 0; i < names_.size(); ++i) {
    by_plain_[plain(names_[i])].push_back(i);
    Words& words = words_.emplace_back();
    for (std::string& word : words_of(names_[i])) words.emplace_back(std::move(word));
    std::uint32_t open = 0;
    for (const auto hash : hashes_of_patterns(words)) by_pattern_.push_back({hash, i, open++});
    const auto& segments = segments_.emplace_back(segments_of(names_[i]));
    by_segments_.push_back({hash_of_segments(segments), i, 0});
    for (const auto hash : hashes_of_shortened(segments)) by_shortened_.push_back({hash, i, 0});
  }
  std::sort(by_pattern_.begin(), by_pattern_.end(), [this](const Entry& a, const Entry& b) {
    return a.hash != b.hash ? a.hash < b.hash : letters_of(a) < letters_of(b);
  });
  for (Entries* entries : {&by_segments_, &by_shortened_}) {
    std::sort(entries->begin(), entries->end(),
              [](const Entry& a, const Entry& b) { return a.hash < b.hash; });
  }
}

const std::string& NameIndex::letters_of(const Entry& entry) const {
  return words_[entry.name][entry.word].letters;
}

bool NameIndex::spend(std::size_t bytes) {
  bytes_left_ -= std::min(bytes_left_, bytes);
  return !is_exhausted();
}

void NameIndex::look_for_slips(std::string_view name, std::map<std::size_t, Resemblance>& found) {
  Words words;
  for (std::string& word : words_of(name)) words.emplace_back(std::move(word));
  const auto patterns = hashes_of_patterns(words);
  for (std::size_t at = 0; at < words.size(); ++at) {
    const std::span<const Entry> entries = entries_of(by_pattern_, patterns[at]);
    const std::string& letters = words[at].letters;
    const auto first = std::partition_point(
        entries.begin(), entries.end(), [&](const Entry& e) { return letters_of(e) < letters; });
    const auto last = std::partition_point(
        first, entries.end(), [&](const Entry& e) { return letters_of(e) == letters; });
    // Siblings are passed over, of which there may be many.
    compare(words, at, {entries.begin(), first}, found);
    compare(words, at, {last, entries.end()}, found);
  }
}

void NameIndex::compare(const Words& words, std::size_t open, std::span<const Entry> entries,
                        std::map<std::size_t, Resemblance>& found) {
  for (const Entry& entry : entries) {
    const NameWord& other = words_[entry.name][entry.word];
    if (!spend(1)) return;
    if (std::popcount(words[open].characters ^ other.characters) > 4) continue;
    if (!spend(words[open].text.size() + other.text.size())) return;
    const Resemblance how = compare_words(words[open], other);
    if (how == Resemblance::kNone || !have_same_pattern(words, words_[entry.name], open)) continue;
    found.emplace(entry.name, how);
  }
}

void NameIndex::look_for_namespaces(std::string_view name,
                                    std::map<std::size_t, Resemblance>& found) {
  const auto segments = segments_of(name);
  const auto try_all = [&](const Entries& entries, std::uint64_t hash) {
    for (const Entry& entry : entries_of(entries, hash)) {
      const auto& other = segments_[entry.name];
      if (!spend(names_[entry.name].size())) return;
      if (is_shortened(other, segments) || is_shortened(segments, other)) {
        found.emplace(entry.name, Resemblance::kSlip);
      }
    }
  };
  try_all(by_shortened_, hash_of_segments(segments));
  for (const auto hash : hashes_of_shortened(segments)) try_all(by_segments_, hash);
}

std::vector<SimilarName> NameIndex::similar_to(std::string_view name) {
  std::map<std::size_t, Resemblance> found;
  if (const auto same = by_plain_.find(plain(name)); same != by_plain_.end()) {
    for (const std::size_t i : same->second) {
      if (!spend(names_[i].size())) break;
      found.emplace(i, Resemblance::kClose);
    }
  }
  look_for_slips(name, found);
  look_for_namespaces(name, found);
  std::vector<SimilarName> result;
  for (const auto& [i, how] : found) {
    if (names_[i] != name) result.push_back({names_[i], how});
  }
  return result;
}

}  // namespace arbiter::rules
