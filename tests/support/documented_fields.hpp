// Holds a page that describes JSON documents to documents that were really made.
//
// A table of the page is headed "| field | type | there | what it says |". If its section begins
// with a word in backticks, that is the object whose fields it names; an array's elements are
// written `array[]`, and the values of an object whose keys are names, `object.*`.
//
//   type   one or more of null, boolean, integer, string, object, "array of strings", …
//   there  "always", or when
//   what   where it begins with "one of: ", these are all the strings that there can be; N stands
//          for a number
#pragma once

#include <algorithm>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/support/page_tables.hpp"

namespace arbiter::test {

// What the documents have had, of every field.
class ObservedFields {
 public:
  struct Field {
    std::size_t count = 0;
    std::set<std::string> types;
    std::set<std::string> strings;
  };

  // `maps`: objects whose keys are names.
  explicit ObservedFields(std::set<std::string> maps = {}) : maps_(std::move(maps)) {}

  void see(const nlohmann::json& document) { see_object(document, ""); }

  [[nodiscard]] const std::map<std::string, Field>& fields() const { return fields_; }
  // How many objects there were that could have had it.
  [[nodiscard]] std::size_t parents(const std::string& path) const {
    if (path.ends_with(".*")) {  // a map may be empty
      const auto field = fields_.find(path);
      return field == fields_.end() ? 0 : field->second.count;
    }
    const auto dot = path.rfind('.');
    const auto found = objects_.find(dot == std::string::npos ? "" : path.substr(0, dot));
    return found == objects_.end() ? 0 : found->second;
  }

 private:
  static std::string type_of(const nlohmann::json& value) {
    if (value.is_number_integer()) return "integer";
    if (!value.is_array()) return value.type_name();
    return value.empty() ? "" : "array of " + type_of(value[0]) + "s";
  }
  void see_object(const nlohmann::json& object, const std::string& path) {
    ++objects_[path];
    const bool is_map = maps_.contains(path);
    std::set<std::string> seen;
    for (const auto& [key, value] : object.items()) {
      const std::string field = (path.empty() ? "" : path + ".") + (is_map ? "*" : key);
      const bool is_first = seen.insert(field).second;
      see_value(value, field, is_first);
    }
  }
  void see_value(const nlohmann::json& value, const std::string& path, bool is_first) {
    Field& field = fields_[path];
    if (is_first) ++field.count;
    if (const std::string type = type_of(value); !type.empty()) field.types.insert(type);
    if (value.is_string()) {
      field.strings.insert(std::regex_replace(value.get<std::string>(), std::regex("[0-9]+"), "N"));
    }
    if (value.is_object()) see_object(value, path);
    if (!value.is_array()) return;
    for (const auto& each : value) {
      if (each.is_object()) see_object(each, path + "[]");
    }
  }

  const std::set<std::string> maps_;
  std::map<std::string, Field> fields_;
  std::map<std::string, std::size_t> objects_;
};

struct DocumentedField {
  int line = 0;
  std::set<std::string> types;
  bool is_always_there = false;
  std::set<std::string> strings;  // empty: any
};

namespace page_detail {

inline std::set<std::string> words_between(const std::string& text, const std::string& separator) {
  std::set<std::string> words;
  std::size_t begin = 0;
  for (auto end = text.find(separator); end != std::string::npos;
       end = text.find(separator, begin)) {
    words.insert(text.substr(begin, end - begin));
    begin = end + separator.size();
  }
  words.insert(text.substr(begin));
  return words;
}

}  // namespace page_detail

inline std::map<std::string, DocumentedField> documented_fields(const std::string& page) {
  std::map<std::string, DocumentedField> fields;
  for (const PageRow& row : rows_of(page, {"field", "type", "there", "what it says"})) {
    const bool is_of_object = row.section.starts_with('`');
    const std::string prefix = is_of_object ? quoted(row.section).at(0) + "." : "";
    DocumentedField field;
    field.line = row.line;
    field.types = page_detail::words_between(row.cells.at(1), " or ");
    field.is_always_there = row.cells.at(2) == "always";
    if (row.cells.at(3).starts_with("one of: ")) {
      const auto values = quoted(row.cells[3].substr(0, row.cells[3].find(". ")));
      field.strings.insert(values.begin(), values.end());
    }
    fields[prefix + quoted(row.cells.at(0)).at(0)] = field;
  }
  return fields;
}

// What the page and the documents do not agree upon, a sentence for each; none where all is well.
inline std::vector<std::string> disagreements(const std::string& page,
                                              const ObservedFields& observed) {
  const auto join = [](const std::set<std::string>& words) {
    std::string text;
    for (const auto& word : words) text += (text.empty() ? "" : ", ") + word;
    return "{" + text + "}";
  };
  std::vector<std::string> found;
  const auto documented = documented_fields(page);
  for (const auto& [path, field] : observed.fields()) {
    if (!documented.contains(path)) found.push_back(path + " is not on the page");
  }
  for (const auto& [path, field] : documented) {
    const std::string where = path + " (line " + std::to_string(field.line) + ")";
    const auto seen = observed.fields().find(path);
    if (seen == observed.fields().end()) {
      found.push_back(where + " is in no document");
      continue;
    }
    if (seen->second.types != field.types) {
      found.push_back(where + " is " + join(field.types) + " on the page and " +
                      join(seen->second.types) + " in documents");
    }
    const bool was_always_there = seen->second.count == observed.parents(path);
    if (was_always_there != field.is_always_there) {
      found.push_back(where + (was_always_there ? " is always there" : " is not always there"));
    }
    if (!field.strings.empty() && seen->second.strings != field.strings) {
      found.push_back(where + " is one of " + join(field.strings) + " on the page and one of " +
                      join(seen->second.strings) + " in documents");
    }
  }
  return found;
}

// The same of an example: it need not have everything.
inline std::vector<std::string> faults_of_example(const std::string& page,
                                                  const nlohmann::json& example) {
  ObservedFields observed;
  observed.see(example);
  std::vector<std::string> found;
  const auto documented = documented_fields(page);
  for (const auto& [path, field] : observed.fields()) {
    const auto on_page = documented.find(path);
    if (on_page == documented.end()) {
      found.push_back(path + " is not on the page");
      continue;
    }
    if (!std::ranges::includes(on_page->second.types, field.types)) {
      found.push_back(path + " has another type than the page says");
    }
  }
  for (const auto& [path, field] : documented) {
    const auto seen = observed.fields().find(path);
    const std::size_t count = seen == observed.fields().end() ? 0 : seen->second.count;
    if (field.is_always_there && count != observed.parents(path)) {
      found.push_back(path + " is missing");
    }
  }
  return found;
}

}  // namespace arbiter::test
