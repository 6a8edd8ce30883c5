#include "rules/text/excerpt.hpp"

#include <string_view>

#include "rules/text/text_file.hpp"
#include "shm/utf8.hpp"

namespace arbiter::rules {
namespace {

struct Character {
  std::string bytes;
  std::size_t columns;
};

// What East Asian characters and most pictographs take, on terminals as in editors.
bool is_wide(std::uint32_t code) {
  return (code >= 0x1100 && code <= 0x115f) || (code >= 0x2e80 && code <= 0xa4cf) ||
         (code >= 0xac00 && code <= 0xd7a3) || (code >= 0xf900 && code <= 0xfaff) ||
         (code >= 0xfe30 && code <= 0xfe6f) || (code >= 0xff00 && code <= 0xff60) ||
         (code >= 0xffe0 && code <= 0xffe6) || (code >= 0x1f300 && code <= 0x1faff) ||
         (code >= 0x20000 && code <= 0x3fffd);
}

bool is_combining(std::uint32_t code) {
  return (code >= 0x300 && code <= 0x36f) || (code >= 0x1ab0 && code <= 0x1aff) ||
         (code >= 0x20d0 && code <= 0x20ff) || (code >= 0xfe00 && code <= 0xfe0f);
}

// A tab is shown as blanks, so that the caret stands below its place whatever the terminal's tabs;
// what has no picture, or a meaning to the terminal, is shown as U+FFFD.
std::vector<Character> take_apart(std::string_view line, std::size_t place,
                                  std::size_t& character_at_place) {
  constexpr std::size_t kTab = 4;
  std::vector<Character> characters;
  std::size_t column = 0;
  character_at_place = std::string_view::npos;
  for (std::size_t i = 0; i < line.size();) {
    if (i >= place && character_at_place == std::string_view::npos) {
      character_at_place = characters.size();
    }
    const shm::Utf8Character character = shm::decode_utf8(line.substr(i));
    const std::size_t length = character.length == 0 ? 1 : character.length;
    if (line[i] == '\t') {
      const std::size_t blanks = kTab - column % kTab;
      characters.push_back({std::string(blanks, ' '), blanks});
    } else if (character.length == 0 || shm::is_control(character.code) ||
               shm::is_invisible(character.code)) {
      characters.push_back({"\xef\xbf\xbd", 1});
    } else {
      const std::size_t columns = is_combining(character.code) ? 0
                                  : is_wide(character.code)    ? 2
                                                               : 1;
      characters.push_back({std::string(line.substr(i, length)), columns});
    }
    column += characters.back().columns;
    i += length;
  }
  if (character_at_place == std::string_view::npos) character_at_place = characters.size();
  return characters;
}

}  // namespace

std::string Excerpts::at(const Location& where) {
  const File& file = this->file(where.file);
  if (where.line < 1 || where.line > file.line_starts.size() || where.column < 1) return {};
  const std::size_t start = file.line_starts[where.line - 1];
  const std::string_view content = file.content;
  // A line's bytes far from the place are of no interest, however many there are. There may be an
  // excerpt of it for each of thousands of findings.
  constexpr std::size_t kMaxBytes = 1024;
  std::string_view line = content.substr(start, content.find('\n', start) - start);
  if (line.ends_with('\r')) line.remove_suffix(1);
  std::size_t place = where.column - 1;
  if (place > line.size()) return {};
  bool cut_before = false, cut_behind = false;
  if (place > kMaxBytes) {
    std::size_t first = place - kMaxBytes / 2;
    while (first < place && (line[first] & 0xc0) == 0x80) ++first;  // not inside a character
    line.remove_prefix(first);
    place -= first;
    cut_before = true;
  }
  if (line.size() > place + kMaxBytes) {
    line = line.substr(0, place + kMaxBytes);
    cut_behind = true;
  }

  std::size_t at = 0;
  const auto characters = take_apart(line, place, at);
  // As much as fits, half of it before the place if there is more than enough on either side.
  std::size_t first = at, last = at, columns = 0;
  while (true) {
    const bool more_before = first > 0, more_behind = last < characters.size();
    if (!more_before && !more_behind) break;
    const bool before = more_before && (at - first <= last - at || !more_behind);
    const std::size_t added = characters[before ? first - 1 : last].columns;
    if (columns + added > kMaxColumns) break;
    columns += added;
    if (before) {
      --first;
    } else {
      ++last;
    }
  }
  cut_before = cut_before || first > 0;
  cut_behind = cut_behind || last < characters.size();
  std::string text = cut_before ? "…" : "", blanks = cut_before ? " " : "";
  for (std::size_t i = first; i < last; ++i) {
    text += characters[i].bytes;
    if (i < at) blanks.append(characters[i].columns, ' ');
  }
  if (cut_behind) text += "…";
  text.erase(text.find_last_not_of(' ') + 1);
  std::string number = std::to_string(where.line);
  if (number.size() < 5) number.insert(0, 5 - number.size(), ' ');
  return number + " |" + (text.empty() ? "" : " " + text) + '\n' + std::string(number.size(), ' ') +
         " | " + blanks + "^\n";
}

const Excerpts::File& Excerpts::file(const std::string& path) {
  const auto [found, is_new] = files_.try_emplace(path);
  File& file = found->second;
  if (!is_new) return file;
  try {  // to read a pipe again would wait for ever
    const TextFile text(path, read_bytes(path, kMaxFileBytes, Accept::kRegularFile));
    file.content = std::string(text.content());
  } catch (const FileError&) {
    return file;
  }
  file.line_starts.push_back(0);
  for (std::size_t i = 0; i < file.content.size(); ++i) {
    if (file.content[i] == '\n') file.line_starts.push_back(i + 1);
  }
  return file;
}

}  // namespace arbiter::rules
