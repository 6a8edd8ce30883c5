#include "rules/report.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <nlohmann/json.hpp>

#include "rules/excerpt.hpp"
#include "rules/names.hpp"
#include "rules/winners.hpp"

namespace arbiter::rules {
namespace {

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

// From the top of each file down, the files in the order in which something was found in them; the
// steps of reading and compiling are of no interest to the reader.
std::vector<const Diagnostic*> in_reading_order(const Diagnostics& diagnostics) {
  std::map<std::string, std::size_t> files;
  std::vector<const Diagnostic*> items;
  for (const auto& item : diagnostics.items()) {
    files.emplace(item.where.file, files.size());
    items.push_back(&item);
  }
  const auto place = [&](const Diagnostic* item) {
    return std::tuple(files.at(item->where.file), item->where.line, item->where.column);
  };
  std::stable_sort(items.begin(), items.end(),
                   [&](const auto* left, const auto* right) { return place(left) < place(right); });
  return items;
}

std::string joined(const std::vector<std::string>& names) {
  if (names.empty()) return "none";
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

bool is_short(const Witness& witness) {
  return std::max(witness.active.size(), witness.inactive.size()) <= kMaxNamesInWords;
}

std::string in_lists(const Witness& witness) {
  return "active: " + joined(witness.active) + "; inactive: " + joined(witness.inactive);
}

nlohmann::ordered_json json_of(const Witness& witness) {
  return {{"active", witness.active}, {"inactive", witness.inactive}};
}

// What to do stands behind the last semicolon of a message.
std::optional<std::string> help_of(const Diagnostic& item) {
  const std::size_t at = item.message.rfind("; ");
  if (at == std::string::npos) return std::nullopt;
  return item.message.substr(at + 2);
}

}  // namespace

std::string counts(const Diagnostics& diagnostics) {
  std::string text;
  for (const Severity severity : {Severity::kError, Severity::kWarning, Severity::kNote}) {
    const auto& items = diagnostics.items();
    const auto count = std::count_if(items.begin(), items.end(), [&](const Diagnostic& item) {
      return item.severity == severity;
    });
    if (count == 0) continue;
    text += (text.empty() ? "" : ", ") + std::to_string(count) + ' ' + name_of(severity) +
            (count == 1 ? "" : "s");
  }
  return text;
}

void write_text(std::ostream& out, const Diagnostics& diagnostics) {
  if (diagnostics.items().empty()) return;
  Excerpts excerpts;
  std::map<std::string_view, std::size_t> notes;  // by code
  for (const Diagnostic* item : in_reading_order(diagnostics)) {
    if (item->severity == Severity::kNote && ++notes[item->code] > kMaxNotesShown) continue;
    out << item->where.file << ':' << item->where.line << ':' << item->where.column << ": "
        << name_of(item->severity) << ": " << item->message << " [" << item->code << "]\n"
        << excerpts.at(item->where);
    // A sentence that has all of it in words says it better.
    const bool is_told = item->witness && is_short(*item->witness) &&
                         item->message.find(in_words(*item->witness)) != std::string::npos;
    if (item->witness && !is_told) out << "  " << in_lists(*item->witness) << '\n';
    for (const Witness& other : item->more_witnesses) {
      out << "  so too " << (is_short(other) ? "with " + in_words(other) : in_lists(other)) << '\n';
    }
  }
  for (const auto& [code, count] : notes) {
    if (count <= kMaxNotesShown) continue;
    out << count - kMaxNotesShown << " more notes [" << code
        << "] are not shown; arbiter check --json has them\n";
  }
  out << counts(diagnostics) << '\n';
}

void write_json(std::ostream& out, const Diagnostics& diagnostics) {
  using Json = nlohmann::ordered_json;
  Json array = Json::array();
  for (const Diagnostic* item : in_reading_order(diagnostics)) {
    Json object = {{"severity", name_of(item->severity)},
                   {"code", item->code},
                   {"file", item->where.file},
                   {"line", item->where.line},
                   {"column", item->where.column},
                   {"message", item->message},
                   {"help", nullptr},
                   {"witness", nullptr},
                   {"more_witnesses", Json::array()}};
    if (const auto help = help_of(*item)) object["help"] = *help;
    if (item->witness) object["witness"] = json_of(*item->witness);
    for (const Witness& other : item->more_witnesses) {
      object["more_witnesses"].push_back(json_of(other));
    }
    array.push_back(std::move(object));
  }
  // A file's name may be any bytes.
  out << array.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
}

}  // namespace arbiter::rules
