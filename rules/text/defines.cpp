#include "rules/text/defines.hpp"

#include <tuple>
#include <utility>
#include <vector>

#include "rules/text/names.hpp"

namespace arbiter::rules {

bool Defines::add(const std::string& name, std::optional<std::string> value, const Location& where,
                  bool is_offered) {
  return defines_.emplace(name, Define{std::move(value), where, is_offered}).second;
}

const Location* Defines::find(const std::string& name) const {
  const auto found = defines_.find(name);
  return found == defines_.end() ? nullptr : &found->second.where;
}

void Defines::announce(const std::string& name, const Location& where) {
  announced_.emplace(name, where);
}

std::optional<Text> Defines::expand(const Text& text, Diagnostics& diagnostics) {
  const std::string& bytes = text.bytes();
  std::size_t use = bytes.find("${");
  if (use == std::string::npos) return text;

  Text result = text.empty_copy();
  std::size_t done = 0;
  for (; use != std::string::npos; use = bytes.find("${", done)) {
    const std::size_t close = bytes.find('}', use);
    if (close == std::string::npos || bytes.find("${", use + 2) < close) {
      diagnostics.error("unterminated-define", text.where(use),
                        "this use of a define does not end; close it with '}'");
      return {};
    }
    const std::string name =
        collapse_blanks(std::string_view(bytes).substr(use + 2, close - use - 2));
    const std::string* value = look_up(name, text, use, diagnostics);
    if (value == nullptr) return {};
    if (result.bytes().size() + (use - done) + value->size() > kMaxExpandedBytes) {
      diagnostics.error("limit-exceeded", text.where(use),
                        "with its defines expanded, this text has more than the limit of " +
                            std::to_string(kMaxExpandedBytes >> 10) + " KiB; use fewer of them");
      return {};
    }
    if (!take_account_of(value->size(), text, use, diagnostics)) return {};
    result.append_part(text, done, use);
    result.append_define(name, *value, text, use, close + 1);
    done = close + 1;
  }
  result.append_part(text, done, bytes.size());
  return result;
}

const std::string* Defines::look_up(const std::string& name, const Text& text, std::size_t at,
                                    Diagnostics& diagnostics) {
  const auto found = defines_.find(name);
  if (found != defines_.end()) {
    found->second.is_used = true;
    return found->second.value ? &*found->second.value : nullptr;
  }
  if (expects_gaps_) return nullptr;
  const auto later = announced_.find(name);
  if (later != announced_.end()) {
    const Location use = text.where(at);
    const Location& begin = later->second;
    const bool is_inside = begin.file == use.file &&
                           std::tie(begin.line, begin.column) < std::tie(use.line, use.column);
    diagnostics.error("unknown-define", use,
                      is_inside ? "${" + name + "} uses itself; write out what it stands for"
                                : "${" + name + "} is used before it is defined, at " +
                                      describe(begin) + "; move the define up");
    return nullptr;
  }
  std::vector<std::string_view> known;
  if (diagnostics.items().size() < kMaxSuggestions) {
    if (const auto file = later_file_with(name); !file.empty()) {
      diagnostics.error("unknown-define", text.where(at),
                        "${" + name + "} is used before it is defined, in " + std::string(file) +
                            "; give that file before this one");
      return nullptr;
    }
    for (const auto& [other, define] : defines_) known.push_back(other);
  }
  diagnostics.error("unknown-define", text.where(at),
                    "no define has the name " + quote(name) +
                        advise(name, known,
                               "write <define name=\"…\"> for it further up, or give the file "
                               "that has it before this one"));
  return nullptr;
}

std::string_view Defines::later_file_with(std::string_view name) const {
  constexpr std::string_view kTag = "<define";
  for (const auto& [path, content] : later_) {
    std::size_t end = 0;
    for (std::size_t at = content.find(kTag); at != std::string_view::npos;
         at = content.find(kTag, end)) {
      end = content.find('>', at);
      if (end == std::string_view::npos) break;
      const std::string_view tag = content.substr(at, end - at);
      const std::size_t quoted = tag.find_first_of("\"'");
      if (quoted == std::string_view::npos) continue;
      const std::string_view rest = tag.substr(quoted + 1);
      if (collapse_blanks(rest.substr(0, rest.find(tag[quoted]))) == name) return path;
    }
  }
  return {};
}

bool Defines::tells_fault_of(const std::string& name) {
  const auto define = defines_.find(name);
  return define != defines_.end() && !std::exchange(define->second.is_faulty, true);
}

void Defines::note_unused(Diagnostics& diagnostics) const {
  for (const auto& [name, define] : defines_) {
    if (define.is_used) continue;
    diagnostics.note("unused-define", define.where,
                     "nothing uses the define " + quote(name) +
                         ": what it says counts nowhere; write ${" + name +
                         "} where it is to count, or remove it");
  }
}

// The account is never given back; a model of this size is refused as a whole.
bool Defines::take_account_of(std::size_t bytes, const Text& text, std::size_t at,
                              Diagnostics& diagnostics) {
  if (expanded_in_all_ > kMaxExpandedBytesInAll) return false;
  expanded_in_all_ += bytes;
  if (expanded_in_all_ <= kMaxExpandedBytesInAll) return true;
  diagnostics.error("limit-exceeded", text.where(at),
                    "from here on, the expanded defines of the model exceed the limit of " +
                        std::to_string(kMaxExpandedBytesInAll >> 20) +
                        " MiB in all; use fewer of them");
  return false;
}

}  // namespace arbiter::rules
