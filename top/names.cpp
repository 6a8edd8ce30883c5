#include "top/names.hpp"

#include <algorithm>
#include <functional>
#include <utility>

namespace arbiter::top {
namespace {

// More widths than a screen has at a time: those that are not in use any more are forgotten.
constexpr std::size_t kMostWidths = 64;
// Of more than that, each is cut by itself: who makes up names must not keep the screen busy.
constexpr std::size_t kMostNames = 1000;
// Of a part, a letter and the mark say something.
constexpr std::size_t kLeastPart = 3;

std::string mark(Charset charset) { return charset == Charset::kUtf8 ? "…" : "~"; }

bool is_within_character(char byte) { return (static_cast<unsigned char>(byte) & 0xc0) == 0x80; }

std::size_t next_character(const std::string& text, std::size_t place) {
  ++place;
  while (place < text.size() && is_within_character(text[place])) ++place;
  return place;
}

std::string first_of(const std::string& text, std::size_t columns) {
  std::size_t end = 0;
  std::size_t width = 0;
  while (end < text.size()) {
    const std::size_t next = next_character(text, end);
    width += columns_of(std::string_view(text).substr(end, next - end));
    if (width > columns) break;
    end = next;
  }
  return text.substr(0, end);
}

std::string last_of(const std::string& text, std::size_t columns) {
  std::size_t begin = 0;
  std::size_t width = columns_of(text);
  while (begin < text.size() && width > columns) {
    const std::size_t next = next_character(text, begin);
    width -= columns_of(std::string_view(text).substr(begin, next - begin));
    begin = next;
  }
  return text.substr(begin);
}

// "/a", "/b_c", "/d:o". What does not begin with a slash is a part, too.
std::vector<std::string> parts_of(const std::string& text) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('/', begin + 1), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end;
  }
  return parts;
}

std::size_t common_beginning(const std::string& a, const std::string& b) {
  const auto differ = std::mismatch(a.begin(), a.end(), b.begin(), b.end());
  return static_cast<std::size_t>(differ.first - a.begin());
}

// Where it differs from the two beside it, of which one begins most as it does.
std::size_t first_difference(const std::vector<std::string>& sorted, std::size_t i) {
  std::size_t place = 0;
  if (i > 0) place = common_beginning(sorted[i], sorted[i - 1]);
  if (i + 1 < sorted.size()) place = std::max(place, common_beginning(sorted[i], sorted[i + 1]));
  return place;
}

// Of names that look alike and have as many parts each.
struct Alike {
  std::vector<std::string> first;      // parts of one of them
  std::vector<std::size_t> beginning;  // of each part: so many bytes are the same in all of them
  std::vector<bool> differs;

  void add(std::vector<std::string> parts) {
    if (first.empty()) {
      for (const std::string& part : parts) beginning.push_back(part.size());
      differs.assign(parts.size(), false);
      first = std::move(parts);
      return;
    }
    for (std::size_t i = 0; i < parts.size(); ++i) {
      beginning[i] = std::min(beginning[i], common_beginning(first[i], parts[i]));
      if (parts[i] != first[i]) differs[i] = true;
    }
  }
};

// Bytes of a part that may be dropped: whole words, which all have. None behind the slash: 0.
std::size_t dropped_of(const std::string& part, std::size_t beginning) {
  const std::size_t word = part.substr(0, beginning).find_last_of("_-.");
  return word == std::string::npos ? 0 : word + 1;
}

// Without the parts that all have, and if need be without the words that parts begin with.
std::string drop_common(const std::vector<std::string>& parts, const Alike& alike, bool drops_words,
                        Charset charset) {
  std::string text;
  bool is_after_mark = false;
  const auto add_mark = [&] {
    if (!is_after_mark) text += (text.empty() ? "" : "/") + mark(charset);
    is_after_mark = true;
  };
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!alike.differs[i] && i + 1 < parts.size()) {
      add_mark();
      continue;
    }
    const std::size_t dropped =
        alike.differs[i] && drops_words ? dropped_of(parts[i], alike.beginning[i]) : 0;
    if (dropped != 0) add_mark();
    text += parts[i].substr(dropped);
    is_after_mark = false;
  }
  return text;
}

// Names that look like `text`, cut in the first way, have the same parts dropped.
std::string group_of(const std::string& text, const std::vector<std::string>& parts) {
  return text + '\0' + std::to_string(parts.size()) + parts.back();
}

}  // namespace

std::string cut_middle(const std::string& text, std::size_t columns, std::size_t eighths,
                       Charset charset) {
  if (columns == 0) return "";
  const std::size_t head = (columns - 1) * eighths / 8;
  return first_of(text, head) + mark(charset) + last_of(text, columns - 1 - head);
}

std::string cut_parts(const std::string& text, std::size_t columns, Charset charset) {
  std::vector<std::string> parts = parts_of(text);
  std::vector<std::pair<std::size_t, std::size_t>> by_width;  // with its place
  std::size_t least = columns_of(parts.back());
  std::size_t room = columns > least ? columns - least : 0;
  for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
    by_width.emplace_back(columns_of(parts[i]), i);
    least += std::min(by_width.back().first, kLeastPart);
  }
  if (by_width.empty() || least > columns) return cut_middle(text, columns, 3, charset);
  std::sort(by_width.begin(), by_width.end());
  std::size_t left = by_width.size();
  for (const auto& [width, i] : by_width) {
    const std::size_t share = room / left--;
    if (width > share) parts[i] = first_of(parts[i], share - 1) + mark(charset);
    room -= std::min(width, share);
  }
  std::string result;
  for (const std::string& part : parts) result += part;
  return result;
}

std::string cut_around(const std::string& text, std::size_t place, std::size_t columns,
                       Charset charset) {
  if (columns < 2) return first_of(mark(charset), columns);
  place = std::min(place, text.size());
  const std::size_t word = place == 0 ? 0 : text.find_last_of("/_-.:", place - 1) + 1;
  const std::string rest = text.substr(word);
  const std::size_t width = columns_of(rest);
  if (width + 1 <= columns) {
    return first_of(text.substr(0, word), columns - 1 - width) + mark(charset) + rest;
  }
  if (word == 0) return first_of(text, columns - 1) + mark(charset);
  return mark(charset) + first_of(rest, columns - 2) + mark(charset);
}

void ShortNames::set(std::vector<std::string> names) {
  if (names == given_) return;
  given_ = std::move(names);
  names_.clear();
  for (const std::string& each : given_) names_.push_back(safe(each, charset_));
  std::sort(names_.begin(), names_.end());
  names_.erase(std::unique(names_.begin(), names_.end()), names_.end());
  cuts_.clear();
}

ShortNames::Cuts ShortNames::cuts_of(std::size_t columns) const {
  std::unordered_map<std::string, Alike> groups;
  const auto first_way = [&](std::size_t i) { return cut_parts(names_[i], columns, charset_); };
  const auto by_difference = [&](std::size_t i) {
    const std::vector<std::string> parts = parts_of(names_[i]);
    const Alike& alike = groups.at(group_of(first_way(i), parts));
    std::string whole = drop_common(parts, alike, false, charset_);
    if (columns_of(whole) <= columns) return whole;
    const std::string least = drop_common(parts, alike, true, charset_);
    return columns_of(least) <= columns ? least : cut_middle(least, columns, 4, charset_);
  };
  const std::vector<std::function<std::string(std::size_t)>> ways = {
      first_way,
      [&](std::size_t i) { return cut_middle(names_[i], columns, 1, charset_); },
      [&](std::size_t i) { return cut_middle(names_[i], columns, 4, charset_); },
      [&](std::size_t i) { return cut_middle(names_[i], columns, 7, charset_); },
      by_difference,
      [&](std::size_t i) {
        return cut_around(names_[i], first_difference(names_, i), columns, charset_);
      }};
  Cuts result;
  std::unordered_map<std::string, int> taken;
  std::vector<std::size_t> open;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    if (columns_of(names_[i]) > columns) {
      open.push_back(i);
      std::vector<std::string> parts = parts_of(names_[i]);
      const std::string group = group_of(first_way(i), parts);
      groups[group].add(std::move(parts));
    } else {
      ++taken[names_[i]];
    }
  }
  for (const auto& way : ways) {
    std::unordered_map<std::string, int> seen = taken;
    std::vector<std::string> texts;
    for (const std::size_t i : open) ++seen[texts.emplace_back(way(i))];
    std::vector<std::size_t> alike;
    for (std::size_t k = 0; k < open.size(); ++k) {
      if (seen[texts[k]] != 1) {
        alike.push_back(open[k]);
      } else {
        ++taken[texts[k]];
        result[names_[open[k]]] = std::move(texts[k]);
      }
    }
    open = std::move(alike);
    if (open.empty()) break;
  }
  return result;
}

std::string ShortNames::cut(const std::string& name, std::size_t columns) {
  std::string text = safe(name, charset_);
  if (columns_of(text) <= columns) return text;
  if (names_.size() > kMostNames) return cut_parts(text, columns, charset_);
  auto known = cuts_.find(columns);
  if (known == cuts_.end()) {
    if (cuts_.size() >= kMostWidths) cuts_.clear();
    known = cuts_.emplace(columns, cuts_of(columns)).first;
  }
  const auto found = known->second.find(text);
  return found == known->second.end() ? cut_parts(text, columns, charset_) : found->second;
}

}  // namespace arbiter::top
