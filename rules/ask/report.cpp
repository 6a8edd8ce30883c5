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
  std::map<std::string, std::size_t> notes;  // by code
  for (const Diagnostic* item : in_reading_order(diagnostics)) {
    if (item->severity == Severity::kNote && ++notes[item->code] > kMaxNotesShown) continue;
    write_item(out, *item, excerpts);
  }
  for (const Omission& omission : diagnostics.omissions()) {
    if (omission.severity != Severity::kNote) out << in_words(omission) << '\n';
  }
  for (const auto& [code, kept] : notes) {
    const std::size_t found = diagnostics.count(Severity::kNote, code);
    if (found <= kMaxNotesShown) continue;
    out << found - kMaxNotesShown << " more notes [" << code
        << "] are not shown; arbiter check --json has "
        << (found == kept ? "them" : "the first " + std::to_string(kept)) << '\n';
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
