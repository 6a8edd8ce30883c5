#include "rules/ask/report.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <nlohmann/json.hpp>

#include "rules/prove/winners.hpp"
#include "rules/text/excerpt.hpp"
#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

using Json = nlohmann::ordered_json;

// Of one code. What is true of each of a thousand ports is read of a few.
constexpr std::size_t kMaxNotesShown = 10;
// Of more than these that say the same of other names, few or many, one is shown, and the places of
// the others.
constexpr std::size_t kMaxAlikeShown = 4;

const char* name_of(Severity severity) {
  switch (severity) {
    case Severity::kError:
      return "error";
    case Severity::kWarning:
      return "warning";
    case Severity::kNote:
      return "note";
  }
  return "error";
}

// Errors first, then warnings, then notes; each from the top of each file down, the files in the
// order in which something was found in them. The steps of reading and compiling are of no interest
// to the reader.
std::vector<const Diagnostic*> in_reading_order(const Diagnostics& diagnostics) {
  std::map<std::string, std::size_t> files;
  std::vector<const Diagnostic*> items;
  for (const auto& item : diagnostics.items()) {
    files.emplace(item.where.file, files.size());
    items.push_back(&item);
  }
  const auto place = [&](const Diagnostic* item) {
    return std::tuple(item->severity, files.at(item->where.file), item->where.line,
                      item->where.column);
  };
  std::stable_sort(items.begin(), items.end(),
                   [&](const auto* left, const auto* right) { return place(left) < place(right); });
  return items;
}

std::string list_or_none(const std::vector<std::string>& names) {
  return names.empty() ? "none" : comma_list(names);
}

bool is_short(const Witness& witness) {
  return std::max(witness.active.size(), witness.inactive.size()) <= kMaxNamesInWords;
}

std::string in_lists(const Witness& witness) {
  return "active: " + list_or_none(witness.active) +
         "; inactive: " + list_or_none(witness.inactive) +
         (witness.is_shortest ? "" : " (nothing of it can be left out; others may be shorter)");
}

Json json_of(const Witness& witness) {
  return {{"active", witness.active},
          {"inactive", witness.inactive},
          {"shortest", witness.is_shortest}};
}

// The fields that each finding has.
Json json_of(Severity severity, const std::string& code, const Location& where,
             const std::string& message) {
  return {{"severity", name_of(severity)},
          {"code", code},
          {"file", where.file},
          {"line", where.line},
          {"column", where.column},
          {"message", message},
          {"help", nullptr},
          {"witness", nullptr},
          {"more_witnesses", Json::array()}};
}

// One port by its name, so that most readers need no list.
void add_subject(Json& object, const Subject& about) {
  const auto or_null = [](const std::string& text) {
    return text.empty() ? Json(nullptr) : Json(text);
  };
  object["port"] = or_null(about.ports.size() == 1 ? about.ports.front() : "");
  object["ports"] = about.ports;
  object["source"] = or_null(about.source);
  object["behaviour"] = or_null(about.behaviour);
  object["statement"] = or_null(about.statement);
  object["winners"] = Json::array();
  for (const auto& [port, winner] : about.winners) {
    object["winners"].push_back({{"port", port}, {"winner", or_null(winner.value_or(""))}});
  }
}

// What to do stands behind the last semicolon of a message, but for those in names: quote() leaves
// no quotes within them.
std::optional<std::string> help_of(const Diagnostic& item) {
  std::optional<std::size_t> at;
  bool is_quoted = false;
  for (std::size_t i = 0; i + 1 < item.message.size(); ++i) {
    if (item.message[i] == '"') is_quoted = !is_quoted;
    if (!is_quoted && item.message.compare(i, 2, "; ") == 0) at = i + 2;
  }
  return at ? std::optional(item.message.substr(*at)) : std::nullopt;
}

void write_item(std::ostream& out, const Diagnostic& item, Excerpts& excerpts) {
  out << printable_place(item.where) << ": " << name_of(item.severity) << ": " << item.message
      << " [" << item.code << "]\n"
      << excerpts.at(item.where);
  // A sentence that has all of it in words says it better.
  const bool is_told = item.witness && is_short(*item.witness) &&
                       item.message.find(in_words(*item.witness)) != std::string::npos;
  if (item.witness && !is_told) out << "  " << in_lists(*item.witness) << '\n';
  for (const Witness& other : item.more_witnesses) {
    out << "  so too " << (is_short(other) ? "with " + in_words(other) : in_lists(other)) << '\n';
  }
}

std::string in_words(const Omission& omission) {
  return std::to_string(omission.count) + " more " + name_of(omission.severity) +
         (omission.count == 1 ? " [" : "s [") + omission.code +
         (omission.count == 1 ? "] was found and is" : "] were found and are") + " not listed";
}

// What is left of a message without names, lists of them, numbers, marks, and what stands in
// parentheses.
std::string frame_of(const std::string& message) {
  std::string frame, word;
  std::size_t depth = 0;
  bool is_quoted = false;
  for (const char c : message + ' ') {
    if (c == '"') is_quoted = !is_quoted;
    depth += c == '(' ? 1 : 0;
    if (c == ' ' && !is_quoted) {
      const bool is_listed = word == "and" || word == "or" || word == "more" || word == "is" ||
                             word == "are" || word.find_first_of("/\"0123456789") == 0;
      if (!is_listed && !word.empty()) frame += word + ' ';
      word.clear();
    } else if (depth == 0 && c != ',' && c != ';') {
      word += c;
    }
    if (c == ')' && depth > 0) --depth;
  }
  return frame;
}

using Alike = std::vector<const Diagnostic*>;

std::string group_of(const Diagnostic& item) { return item.code + '\n' + frame_of(item.message); }

// Notes of one code that differ in names, and in how many there are, only.
std::map<std::string, Alike> groups_of_notes(const std::vector<const Diagnostic*>& items) {
  std::map<std::string, Alike> groups;
  for (const Diagnostic* item : items) {
    if (item->severity != Severity::kNote) continue;
    groups[group_of(*item)].push_back(item);
  }
  return groups;
}

// "12 more of this kind, each with its own names: line 7 (/Arm/pos:i), b.xml:3:5 (/Torso/pos:i)".
void write_others(std::ostream& out, const Alike& alike) {
  out << "  and " << alike.size() - 1 << " more of this kind, each with its own names: ";
  const std::size_t listed = std::min(alike.size(), kMaxNotesShown);
  for (std::size_t i = 1; i < listed; ++i) {
    const Location& where = alike[i]->where;
    const Subject& about = alike[i]->about;
    out << (i == 1 ? "" : ", ")
        << (where.file == alike[0]->where.file ? "line " + std::to_string(where.line)
                                               : printable_place(where));
    if (about.ports.size() == 1) out << " (" << about.ports.front() << ')';
  }
  out << (listed < alike.size() ? ", …" : "") << "; arbiter check --json has each\n";
}

}  // namespace

std::string counts(const Diagnostics& diagnostics) {
  std::string text;
  for (const Severity severity : {Severity::kError, Severity::kWarning, Severity::kNote}) {
    const std::size_t count = diagnostics.count(severity);
    if (count == 0) continue;
    text += (text.empty() ? "" : ", ") + std::to_string(count) + ' ' + name_of(severity) +
            (count == 1 ? "" : "s");
  }
  return text;
}

void write_text(std::ostream& out, const Diagnostics& diagnostics) {
  if (diagnostics.items().empty()) return;
  Excerpts excerpts;
  const auto items = in_reading_order(diagnostics);
  const auto groups = groups_of_notes(items);
  struct Told {
    std::size_t kept = 0, whole = 0, listed = 0;
  };
  std::map<std::string, Told> notes;  // by code
  for (const Diagnostic* item : items) {
    if (item->severity != Severity::kNote) {
      write_item(out, *item, excerpts);
      continue;
    }
    Told& told = notes[item->code];
    ++told.kept;
    const Alike& alike = groups.at(group_of(*item));
    const bool is_group = alike.size() > kMaxAlikeShown;
    if ((is_group && item != alike.front()) || told.whole == kMaxNotesShown) continue;
    ++told.whole;
    write_item(out, *item, excerpts);
    if (!is_group) continue;
    write_others(out, alike);
    told.listed += alike.size() - 1;
  }
  for (const Omission& omission : diagnostics.omissions()) {
    if (omission.severity != Severity::kNote) out << in_words(omission) << '\n';
  }
  for (const auto& [code, told] : notes) {
    const std::size_t found = diagnostics.count(Severity::kNote, code);
    const std::size_t left = found - told.whole - told.listed;
    if (left == 0) continue;
    out << left << " more notes [" << code << "] are not shown; arbiter check --json has "
        << (found == told.kept ? "them" : "the first " + std::to_string(told.kept)) << '\n';
  }
  out << counts(diagnostics) << '\n';
}

void write_json(std::ostream& out, const Diagnostics& diagnostics) {
  Json array = Json::array();
  for (const Diagnostic* item : in_reading_order(diagnostics)) {
    Json object = json_of(item->severity, item->code, item->where, item->message);
    if (const auto help = help_of(*item)) object["help"] = *help;
    if (item->witness) object["witness"] = json_of(*item->witness);
    for (const Witness& other : item->more_witnesses) {
      object["more_witnesses"].push_back(json_of(other));
    }
    add_subject(object, item->about);
    array.push_back(std::move(object));
  }
  for (const Omission& omission : diagnostics.omissions()) {
    Json object = json_of(omission.severity, "not-listed", omission.where, in_words(omission));
    add_subject(object, {});
    object["code_omitted"] = omission.code;
    object["count"] = omission.count;
    array.push_back(std::move(object));
  }
  // A file's name may be any bytes.
  out << array.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
}

}  // namespace arbiter::rules
