#include "evidence/record_schemas.hpp"

#include <sstream>
#include <stdexcept>

#include <nlohmann/json.hpp>

namespace arbiter::evidence {
namespace {

using nlohmann::ordered_json;

// int:   whole number, 0 or more        text:  string
// bool                                  texts: list of strings
// files: [{path, text}]                 a|b|c: one of these words
// A question mark behind it: the field is not there where its value is not known.
ordered_json schema_of(const std::string& type) {
  if (type == "int") return {{"type", "integer"}, {"minimum", 0}};
  if (type == "bool") return {{"type", "boolean"}};
  if (type == "text") return {{"type", "string"}};
  if (type == "texts") return {{"type", "array"}, {"items", {{"type", "string"}}}};
  if (type == "files") {
    const ordered_json file{
        {"type", "object"},
        {"properties", {{"path", {{"type", "string"}}}, {"text", {{"type", "string"}}}}},
        {"required", {"path", "text"}},
        {"additionalProperties", false}};
    return {{"type", "array"}, {"items", file}};
  }
  ordered_json words = ordered_json::array();
  std::istringstream all(type);
  for (std::string word; std::getline(all, word, '|');) words.push_back(word);
  if (words.size() < 2) throw std::logic_error("no type: " + type);
  return {{"type", "string"}, {"enum", words}};
}

}  // namespace

// One place says what a record has; writer, reader and the page are tested against it.
const std::array<RecordSchema, kRecordKinds> record_schemas{{
    {"arbiter/start", "arbiter.Start", "time_ns:int instance:text ports:texts payloads:text"},
    {"arbiter/arrival", "arbiter.Arrival",
     "source:text kind:sample|signal time_ns:int seen_ns:int sequence:int size:int generation:int "
     "activity:never|until|forever|deactivated activity_ns:int has_payload:bool "
     "accepted:texts discarded:texts refused:texts blind:texts origin:text? origin_sequence:int?"},
    {"arbiter/deactivation", "arbiter.Deactivation",
     "source:text time_ns:int seen_ns:int sequence:int generation:int"},
    {"arbiter/state", "arbiter.State",
     "source:text why:page|joined|gap|closed time_ns:int seen_ns:int sequence:int generation:int "
     "lost:int activity:never|until|forever|deactivated activity_ns:int type:text? type_size:int? "
     "type_alignment:int? destinations:texts?"},
    {"arbiter/destinations", "arbiter.Destinations",
     "source:text time_ns:int seen_ns:int destinations:texts"},
    {"arbiter/port", "arbiter.Port",
     "what:open|opened|closed|died direction:input|output port:text node:text pid:int type:text "
     "seen_ns:int host:text?"},
    {"arbiter/model", "arbiter.Model",
     "time_ns:int seen_ns:int generation:int name:text how:text by:text has_texts:bool files:files "
     "application:files"},
    {"arbiter/winner", "arbiter.Winner",
     "port:text winner:text before:text time_ns:int "
     "why:start|arrival|expiry|deactivation|model|state by:text generation:int"},
    {"arbiter/missed", "arbiter.Missed",
     "source:text from_ns:int to_ns:int events:int samples:int "
     "why:overtaken|queue|refused|stranger|too_large|memory|other text:text"},
}};

std::string RecordSchema::json() const {
  ordered_json all = ordered_json::object();
  ordered_json required = ordered_json::array();
  std::istringstream list{std::string(properties)};
  for (std::string property; list >> property;) {
    const auto colon = property.find(':');
    const std::string called = property.substr(0, colon);
    const bool is_optional = property.back() == '?';
    if (is_optional) property.pop_back();
    all[called] = schema_of(property.substr(colon + 1));
    if (!is_optional) required.push_back(called);
  }
  return ordered_json{{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                      {"title", name},
                      {"type", "object"},
                      {"properties", all},
                      {"required", required},
                      {"additionalProperties", false}}
      .dump();
}

}  // namespace arbiter::evidence
